"""kincheck bisect: the release of a simulator that changed a result, the term, and who is right."""

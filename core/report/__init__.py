"""Reports: results as table, JSON, JUnit XML, Markdown and one HTML file."""

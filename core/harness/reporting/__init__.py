"""Address of the report before version 0.2; `kincheck.core.report` has it now."""

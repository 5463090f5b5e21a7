"""Reporting: results as a table, JSON, JUnit XML, Markdown and one HTML file."""

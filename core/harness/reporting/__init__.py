"""Former package of the report, kept for scripts written before version 0.2; see
`kincheck.core.report`.
"""

"""Readers and writers of case files and reference tables; an input error gives one message."""

"""Closed poses without a motion to them: from estimates and from many starts, distinguished by
their branch.
"""

"""Poses that close, without a motion that leads to them: from estimates, from many starts, told
apart by their branch.
"""

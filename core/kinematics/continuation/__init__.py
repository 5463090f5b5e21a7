"""Where a motion meets a singular pose: what is there, how it goes on beyond it, and by its length
where the driver turns back.
"""

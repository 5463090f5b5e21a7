"""Worker processes isolate pairs: a crash, a hang or a flood of output costs only its pair."""

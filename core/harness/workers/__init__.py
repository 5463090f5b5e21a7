"""Worker processes: pairs solved where a crash, a hang or a flood costs nothing but the pair."""

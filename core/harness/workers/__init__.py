"""Worker processes: pairs solved in isolation. A crash, a hang or a flood costs only the pair."""

"""One mechanism as compiled programs: request, rows, program layout, samples."""

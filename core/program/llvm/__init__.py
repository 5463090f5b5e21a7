"""Programs and their loops as machine code: LLVM text, compilation, cache and calls."""

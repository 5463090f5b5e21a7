"""Analysis: from the description of a mechanism to its motion.

The modules beside this one are the main road: `solve`, `prepare` (by size), `request`, `tracing` of `programs`, `model`, `route`,
`march` and `sweep`. The rooms hold what comes before it (`equations`, `structure`), what it turns to at singular poses (`singular`)
and for large mechanisms (`cascade`, `sparse`), and what else is made of equations (`assembly`, `diagnosis`, `proofs`).
"""

"""Analysis: from the description of a mechanism to its motion.

The modules beside this one are the main road of one mechanism:

    solve, designs      what users call: one design, or many
    prepare             as one program, component by component or as a sparse system, by size
    request             what is wanted, and where it stands in a lane
    tracing             the programs of a request, kept on disk: `programs` (Newton, outputs), `prediction`, `acceptance`
    model               a mechanism made ready: rows selected, programs traced, lanes laid out
    route               a model and the samples of a path
    march, sweep        a route followed from lane to lane; and judged, with what lies beyond singular poses
    variants            as many designs as there are lanes
    system              the same equations as plain matrices, for what is rare
    continuity, interpolation, thread_cache     limits, weights, and what each thread keeps

The rooms hold what comes before it (`equations`, `structure`), what it turns to at singular poses
(`singular`) and for large mechanisms (`cascade`, `sparse`), and what else is made of equations
(`assembly`, `diagnosis`, `proofs`).
"""

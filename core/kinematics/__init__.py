"""Kinematics: from the description of a mechanism to its motion.

The modules in this folder solve one mechanism:

    solve                one design over a sweep
    design_sweep         many designs over a sweep, each with its own geometry
    design_batch         many variants along one path, one variant in each lane
    solver_selection     one program, component by component or a sparse system, by size

The folders:

    formulation      constraints as equations, in Cartesian or joint coordinates
    structure        degrees of freedom, redundant rows, components, sparse factors
    compiled         one mechanism as compiled programs: request, programs, model, samples
    continuation     the walk along a path, step halving, singular poses, curves by arc length
    by_components    large mechanisms, component by component
    sparse           large mechanisms without small components, as a sparse system
    assembly         closed poses from estimates and random starts
    diagnosis        rank, conditioning and screws at a pose
    verified         samples enclosed in balls by Krawczyk's test
"""

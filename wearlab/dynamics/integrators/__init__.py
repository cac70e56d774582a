"""Advancing a motion over one step.

Here are the system as compiled code takes it, the law of the mesh, and the steps.

A method is one file: `rk4` (small systems, and trajectories of larger ones), `exact`
(larger ones), `newmark`, `rk45`. `mesh_law` says what the meshes exert,
`contact_change` cuts a step where a flank begins or ceases to touch or to push: the
motion is a `power_series` there, which tells the `first_change`. `count` says how many
steps a mesh period takes, `kernel` decides which systems are small.
"""

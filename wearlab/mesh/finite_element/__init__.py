"""Stiffness from plane finite elements: the default, and the reference of all methods.

Nothing here knows of beams or foundation formulas. One sector of each gear (a tooth,
its roots, its share of the body down to the clamp) is meshed with biquadratic
quadrilaterals on its true outline; the whole toothed wheel follows exactly from its
rotational symmetry; the local indentation under the load is taken out in closed form,
so that the contact can be added by any of the Hertzian models.
"""

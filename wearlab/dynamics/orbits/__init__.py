"""The steady response: how an orbit is found, judged, followed, and what a response is.

`periodic` is the way through: `shooting` integrates and shoots on the map over a mesh period (`period_map`),
`shoot` is Newton's method on it, `integrate` what is done where no orbit attracts and by the methods that
integrate until steady. `multipliers` judge, `response` and `path` hold the answer, `coexisting` looks for
others beside it, `continuation` follows it over speed.
"""

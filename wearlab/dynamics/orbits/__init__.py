"""The steady response: how an orbit is found, judged and followed, and what a response is.

`periodic` is the way through. `period_map` advances a state over a mesh period with its tangents; `shoot` is
Newton's method on that map, and `shooting` keeps its account and judges an orbit by its multipliers;
`integrate` is what is done where no orbit attracts, and by methods that integrate until steady. `response` is
the answer, `coexisting` looks for others beside it, `continuation` follows it over speed.
"""

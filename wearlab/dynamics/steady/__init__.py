"""The steady response: how an orbit is found, judged and followed.

`periodic` is the way through. `integrate` advances a state over mesh periods, with its
tangents; `until_steady` does so until nothing changes, by the methods of the papers;
`shooting` is Newton's method on that map, keeps its account, and judges an orbit by its
multipliers. `response` is the answer, `coexisting` looks for others beside it,
`continuation` follows it over speed.
"""

"""The ways to find a steady response: one road, ``method.solve(system, tables, period, start)``."""

from wearlab.dynamics.orbits.integrate import RungeKutta4
from wearlab.dynamics.orbits.periodic import Periodic
from wearlab.dynamics.steps.newmark import Newmark
from wearlab.dynamics.steps.rk45 import RungeKutta45

Method = Periodic | RungeKutta4 | RungeKutta45 | Newmark

__all__ = ["Method", "Newmark", "Periodic", "RungeKutta4", "RungeKutta45"]

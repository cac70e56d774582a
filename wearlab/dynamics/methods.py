"""The ways to find a steady response: one road, ``method.solve(system, tables, period, start)``."""

from wearlab.dynamics.newmark import Newmark
from wearlab.dynamics.periodic import Periodic
from wearlab.dynamics.runge_kutta4 import RungeKutta4
from wearlab.dynamics.runge_kutta45 import RungeKutta45

Method = Periodic | RungeKutta4 | RungeKutta45 | Newmark

__all__ = ["Method", "Newmark", "Periodic", "RungeKutta4", "RungeKutta45"]

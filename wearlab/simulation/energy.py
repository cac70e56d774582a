"""The balance of energy over a period, named as the dataset names it."""

from typing import Any

from wearlab.dynamics.forces.energy import energy_balance
from wearlab.dynamics.orbits.response import Response
from wearlab.life.vibration import Vibration
from wearlab.scene.build import Parts

Values = dict[str, Any]


def energy_values(parts: Parts, vibration: Vibration, response: Response) -> Values:
    """Return every term of the balance of energy [W], its residual and the efficiency, where flanks rub."""
    if vibration.nominal is None or parts.friction is None:
        return {}
    balance = energy_balance(response, vibration.nominal)
    values: Values = {f"energy_{name}": power for name, power in balance._asdict().items()}
    return values | {"residual_energy": balance.residual, "efficiency": balance.efficiency}

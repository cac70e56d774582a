"""Gear materials by the names of the shop: elastic constants, density and the hardness that is usual.

Elastic constants and densities are those of the standards or handbooks named; a hardness is the middle of
what the heat treatment usually gives, and is assumed until the scene says it. Plastics soften with
temperature: theirs hold dry at 23 °C.
"""

from typing import NamedTuple

from wearlab.shop.hardness import pressure_of


class NamedMaterial(NamedTuple):
    """A material of the catalogue.

    Parameters
    ----------
    youngs_modulus, poisson_ratio, density : [Pa], [1], [kg/m³]
    hardness : usual hardness of the flank [Pa], None where a hardness number says nothing
    treatment : what the hardness belongs to, in words
    source : where the constants come from
    """

    youngs_modulus: float
    poisson_ratio: float
    density: float
    hardness: float | None
    treatment: str
    source: str


STEEL = "ISO 6336-2:2016 (E = 206 GPa, ν = 0.3)"
CASE = ("60 HRC, case-hardened (ISO 6336-5: 58 to 64 HRC)", pressure_of(60.0, "HRC"))


def _steel(treatment: str, hardness: float | None) -> NamedMaterial:
    return NamedMaterial(206e9, 0.3, 7830.0, hardness, treatment, STEEL)


MATERIALS: dict[str, NamedMaterial] = {
    "steel": NamedMaterial(206e9, 0.3, 7830.0, None, "", "L16 Table 1"),
    **{name: _steel(*CASE) for name in ("16MnCr5", "20MnCr5", "18CrNiMo7-6", "17CrNiMo6", "18CrMo4")},
    "42CrMo4": _steel("300 HV, quenched and tempered", pressure_of(300.0, "HV")),
    "34CrNiMo6": _steel("310 HV, quenched and tempered", pressure_of(310.0, "HV")),
    "31CrMoV9": _steel("700 HV, nitrided", pressure_of(700.0, "HV")),
    "C45": _steel("200 HB, normalised", pressure_of(200.0, "HB")),
    "EN-GJL-250": NamedMaterial(
        110e9, 0.26, 7200.0, pressure_of(210.0, "HB"), "210 HB, as cast", "EN 1561:2011, Annex (103-118 GPa)"
    ),
    "EN-GJS-400-15": NamedMaterial(
        169e9, 0.275, 7100.0, pressure_of(155.0, "HB"), "155 HB, as cast", "EN 1563:2018, Annex"
    ),
    "EN-GJS-700-2": NamedMaterial(
        176e9, 0.275, 7200.0, pressure_of(260.0, "HB"), "260 HB, as cast", "EN 1563:2018, Annex"
    ),
    "POM": NamedMaterial(2.8e9, 0.35, 1410.0, None, "dry, 23 °C", "VDI 2736-1:2016, POM-C"),
    "PA66": NamedMaterial(3.0e9, 0.38, 1140.0, None, "dry, 23 °C", "VDI 2736-1:2016, PA 66"),
}
ALIASES = {
    "cast iron": "EN-GJL-250",
    "GG25": "EN-GJL-250",
    "GGG40": "EN-GJS-400-15",
    "GGG70": "EN-GJS-700-2",
    "POM-C": "POM",
    "PA 66": "PA66",
    "1.6587": "18CrNiMo7-6",
    "1.7131": "16MnCr5",
    "1.7147": "20MnCr5",
    "1.7225": "42CrMo4",
    "1.0503": "C45",
}


def known(name: str) -> str | None:
    """Return the name in the catalogue that a shop's name means, None when there is none."""
    plain = {key.lower().replace(" ", ""): key for key in MATERIALS}
    plain |= {key.lower().replace(" ", ""): target for key, target in ALIASES.items()}
    return plain.get(name.lower().replace(" ", ""))

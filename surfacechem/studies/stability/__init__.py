"""What the solvers make of the dangerous regimes: solved to so many digits, refused for the right reason, or failed.

>>> from surfacechem.studies.stability import stability
>>> study = stability("seconds", solvers=["radau"], quick=True, rounds=0)
>>> bool(study.dataset["digits"].min() > 9)
True
"""

from surfacechem.studies.stability.study import Study, stability

__all__ = ["Study", "stability"]

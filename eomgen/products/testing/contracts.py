"""Contract tests for authors of other distributions, public as ``eomgen.testing``.

Each function checks one thing that a distribution brings, raises ContractError with the demand that is not met, and
needs no framework of tests: authors call the functions from tests of any framework.
"""

from eomgen.products.testing.demands import ContractError
from eomgen.products.testing.force_elements import check_force_element
from eomgen.products.testing.integrators import check_integrator
from eomgen.products.testing.joint_types import check_joint_type
from eomgen.products.testing.laws import check_law

__all__ = ["ContractError", "check_force_element", "check_integrator", "check_joint_type", "check_law"]

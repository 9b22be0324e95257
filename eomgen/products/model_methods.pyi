"""Methods of Model, for type checkers and editors: from the register of verbs, by
``python -m tests.model_stub``."""

from eomgen.compiled.argument_derivatives import derivatives as _derivatives
from eomgen.compiled.argument_derivatives import hessian as _hessian
from eomgen.compiled.argument_derivatives import sparsity as _sparsity
from eomgen.compiled.base_parameters import base_parameters as _base_parameters
from eomgen.compiled.rest.equilibrium import equilibrium as _equilibrium
from eomgen.compiled.saving import save as _save
from eomgen.products.derivatives.linearise import sensitivities as _sensitivities
from eomgen.products.ensembles.simulate_many import simulate_many as _simulate_many
from eomgen.products.linear.analyses.linearize import linearize as _linearize
from eomgen.products.linear.analyses.parameter_sweeps import campbell as _campbell
from eomgen.products.linear.analyses.parameter_sweeps import root_locus as _root_locus
from eomgen.products.linear.analyses.periodic_motions import floquet as _floquet
from eomgen.products.linear.analyses.road_excitation import road_excitation as _road_excitation
from eomgen.products.pages.live import live as _live
from eomgen.products.pages.report import report as _report
from eomgen.products.statics.path_following import buckling_loads as _buckling_loads
from eomgen.products.statics.path_following import equilibrium_path as _equilibrium_path
from eomgen.products.statics.steady_motion import steady_motion as _steady_motion
from eomgen.simulation.resume import resume as _resume
from eomgen.simulation.run_model import attach as _attach
from eomgen.simulation.simulate import simulate as _simulate
from eomgen.simulation.start import start as _start

class ModelMethods:
    derivatives = _derivatives
    hessian = _hessian
    sparsity = _sparsity
    base_parameters = _base_parameters
    equilibrium = _equilibrium
    save = _save
    sensitivities = _sensitivities
    simulate_many = _simulate_many
    linearize = _linearize
    campbell = _campbell
    root_locus = _root_locus
    floquet = _floquet
    road_excitation = _road_excitation
    live = _live
    report = _report
    buckling_loads = _buckling_loads
    equilibrium_path = _equilibrium_path
    steady_motion = _steady_motion
    resume = _resume
    attach = _attach
    simulate = _simulate
    start = _start

"""Methods of SceneBuilder from the register of sections, and keys of other methods, for type checkers, by
``python -m tests.builder_keys eomgen/scene/builder_keys.pyi``."""

from collections.abc import Mapping, Sequence
from typing import Any, Self, TypedDict

from eomgen.scene.builder_methods import Rotations, Value

class IncludeKeys(TypedDict, total=False):
    prefix: str | None
    parent: str | None
    position: Sequence[Value] | None
    rotation: Rotations | None
    parameters: Mapping[str, Value] | None
    initial: Mapping[str, Mapping[str, Any]] | None
    root: str | None
    lock: Sequence[str] | None
    limits: bool | None
    friction: bool | None
    actuated: bool | None
    transmissions: bool | None
    tunable: Sequence[str] | None
    keyframe: str | None
    mocap: bool | None
    weld: Sequence[str] | None
    packages: Sequence[str] | None

class SimulationKeys(TypedDict, total=False):
    method: str | None
    step: Value | None
    duration: Value | None
    rho_inf: float | None
    alpha: float | None
    beta: float | None
    gamma: float | None
    tolerance: float | None
    order: int | None
    settings: Mapping[str, float] | None
    real: str | None
    record_every: int | None
    start: str | None

class SectionMethods:
    def parameter(
        self,
        name: str,
        value: Value,
        *,
        tunable: bool | None = ...,
        unit: str | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def curve(
        self,
        name: str,
        *,
        table: Mapping[str, Any] | None = ...,
        points: Sequence[Sequence[Value]] | None = ...,
        interpolation: str | None = ...,
        outside: str | None = ...,
        wave: Mapping[str, Any] | None = ...,
        bump: Mapping[str, Any] | None = ...,
        road: Mapping[str, Any] | None = ...,
        argument_unit: str | None = ...,
        unit: str | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def map(
        self,
        name: str,
        *,
        table: Mapping[str, Any] | None = ...,
        x: float | Sequence[float] | None = ...,
        y: float | Sequence[float] | None = ...,
        values: Sequence[float | Sequence[float]] | None = ...,
        x_unit: str | None = ...,
        y_unit: str | None = ...,
        value_unit: str | None = ...,
        interpolation: str | None = ...,
        outside: str | None = ...,
        unit: str | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def law(
        self,
        name: str,
        *,
        source: str | None = ...,
        python: str | None = ...,
        function: str,
        partials: str | None = ...,
        complex_step: bool | None = ...,
        arguments: Mapping[str, str],
        results: Mapping[str, str],
        parameters: Mapping[str, Value] | None = ...,
        scales: Mapping[str, float] | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def definition(
        self,
        name: str,
        formula: Value,
        *,
        unit: str | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def input(
        self,
        name: str,
        formula: Value | None = ...,
        *,
        table: Mapping[str, Any] | None = ...,
        points: Sequence[Sequence[Value]] | None = ...,
        interpolation: str | None = ...,
        outside: str | None = ...,
        wave: Mapping[str, Any] | None = ...,
        road: Mapping[str, Any] | None = ...,
        motion: bool | None = ...,
        initial: float | None = ...,
        unit: str | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def random(
        self,
        name: str,
        type: str | None = ...,
        *,
        correlation: Mapping[str, float] | None = ...,
        coherence: Mapping[str, float | Sequence[Sequence[Value]]] | None = ...,
        follows: str | None = ...,
        mean: Value | None = ...,
        standard_deviation: Value | None = ...,
        correlation_time: Value | None = ...,
        correlation_length: Value | None = ...,
        decay: Value | None = ...,
        frequency: Value | None = ...,
        damping: Value | None = ...,
        band: Sequence[Value] | None = ...,
        road_class: str | None = ...,
        points: Sequence[Sequence[Value]] | None = ...,
        table: Mapping[str, Any] | None = ...,
        duration: Value | None = ...,
        speed: Value | None = ...,
        offset: Value | None = ...,
        delay: Value | None = ...,
        share: float | None = ...,
        modes: int | None = ...,
        seed: int | None = ...,
        translation: Value | None = ...,
        distribution: str | None = ...,
        quantiles: Sequence[Sequence[Value]] | None = ...,
        covariance_of: str | None = ...,
        covariance_repair: str | None = ...,
        unit: str | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def waves(
        self,
        name: str,
        *,
        spectrum: Mapping[str, Any] | None = ...,
        regular: Sequence[Mapping[str, Any]] | None = ...,
        components: int | None = ...,
        band: Sequence[Value] | None = ...,
        heading: Value | None = ...,
        spreading: Mapping[str, Any] | None = ...,
        seed: int | None = ...,
        amplitudes: str | None = ...,
        variables: bool | None = ...,
        depth: Value | None = ...,
        level: Value | None = ...,
        ramp: Value | None = ...,
        order: str | None = ...,
        stretching: str | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def state(
        self,
        name: str,
        rate: Value | None = ...,
        *,
        sample: Value | None = ...,
        formula: Value | None = ...,
        delay: Value | None = ...,
        quantum: Value | None = ...,
        initial: Value | None = ...,
        unit: str | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def controller(
        self,
        name: str,
        type: str,
        signal: Value | None = ...,
        *,
        proportional: Value | None = ...,
        integral: Value | None = ...,
        derivative: Value | None = ...,
        gain: Value | None = ...,
        time_constant: Value | None = ...,
        lead: Value | None = ...,
        minimum: Value | None = ...,
        maximum: Value | None = ...,
        tracking: Value | None = ...,
        initial: Value | None = ...,
        initial_filtered: Value | None = ...,
        outputs: Sequence[str] | None = ...,
        coordinates: Sequence[str] | None = ...,
        signals: Mapping[str, Value] | None = ...,
        position_references: Mapping[str, Value] | None = ...,
        signal_references: Mapping[str, Value] | None = ...,
        position_gains: Mapping[str, float | Sequence[float]] | None = ...,
        velocity_gains: Mapping[str, float | Sequence[float]] | None = ...,
        signal_gains: Mapping[str, float | Sequence[float]] | None = ...,
        calibration: Mapping[str, Any] | None = ...,
        spring: str | None = ...,
        damping: Value | None = ...,
        groundhook: Value | None = ...,
        clipped: bool | None = ...,
        minimum_damping: Value | None = ...,
        maximum_damping: Value | None = ...,
        width: Value | None = ...,
        sample: Value | None = ...,
        delay: Value | None = ...,
        quantum: Value | None = ...,
        source: str | None = ...,
        function: str | None = ...,
        memory: int | None = ...,
        unit: str | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def base(
        self,
        position: Sequence[Value] | None = ...,
        rotation: Rotations | None = ...,
        *,
        acceleration: Sequence[Value] | None = ...,
        drift: str | None = ...,
        follow: Mapping[str, Any] | None = ...,
    ) -> Self: ...
    def body(
        self,
        name: str,
        mass: Value,
        *,
        center_of_mass: Sequence[Value] | None = ...,
        inertia: Sequence[Any] | Mapping[str, Value] | None = ...,
        check_inertia: bool | None = ...,
        given_in: str | None = ...,
        group: str | None = ...,
    ) -> Self: ...
    def beam(
        self,
        name: str,
        length: Value | None = ...,
        *,
        model: str | None = ...,
        start: Value | None = ...,
        section: Mapping[str, Any] | None = ...,
        mass_per_length: Value | None = ...,
        polar_inertia: Value | None = ...,
        mass_profile: Value | Sequence[Value] | None = ...,
        polar_profile: Value | Sequence[Value] | None = ...,
        order: int | None = ...,
        stiffening: bool | None = ...,
        bending_y: Mapping[str, Any] | None = ...,
        bending_z: Mapping[str, Any] | None = ...,
        stretch: Mapping[str, Any] | None = ...,
        torsion: Mapping[str, Any] | None = ...,
        elements: int | None = ...,
        parts: Sequence[Mapping[str, Any]] | None = ...,
        stiffness: Mapping[str, Any] | None = ...,
        stiffness_matrix: Sequence[Sequence[Value]] | None = ...,
        damping: Mapping[str, Any] | None = ...,
        stiffness_damping: Value | None = ...,
        rotary_inertia: Sequence[Value] | None = ...,
        center_of_mass: Sequence[Value] | None = ...,
        inertia_matrix: Sequence[Sequence[Value]] | None = ...,
        curvature: Sequence[Value] | None = ...,
        shape: Mapping[str, Any] | None = ...,
        pretwist: Value | None = ...,
        prestrain: Mapping[str, Any] | None = ...,
        group: str | None = ...,
    ) -> Self: ...
    def joint(
        self,
        name: str,
        type: str,
        parent: str,
        child: str,
        *,
        position: Sequence[Value] | None = ...,
        rotation: Rotations | None = ...,
        orientation: Sequence[Sequence[float]] | None = ...,
        given_in: str | None = ...,
        axis: Sequence[Value] | None = ...,
        second_axis: Sequence[Value] | None = ...,
        x_axis: Sequence[Value] | None = ...,
        pitch: Value | None = ...,
        stiffness: Value | Sequence[Value] | None = ...,
        damping: Value | Sequence[Value] | None = ...,
        rest: Value | Sequence[Value] | None = ...,
        rotor_inertia: Value | Sequence[Value] | None = ...,
        limits: Mapping[str, Any] | None = ...,
        friction: Mapping[str, Any] | None = ...,
        drive: Value | Sequence[Value] | None = ...,
        smooth: Value | None = ...,
        mimic: Mapping[str, Any] | None = ...,
        initial: Mapping[str, Any] | None = ...,
    ) -> Self: ...
    def constraint(
        self,
        name: str,
        type: str,
        first: str | Mapping[str, Any] | None = ...,
        second: str | Mapping[str, Any] | None = ...,
        *,
        drive: Value | None = ...,
        length: Value | None = ...,
        smooth: Value | None = ...,
        radius: Value | None = ...,
        shape: str | None = ...,
        semi_axes: Sequence[Value] | None = ...,
        tube_radius: Value | None = ...,
        surface: Value | None = ...,
        pitch: Value | None = ...,
        equation: Value | None = ...,
        velocity_equation: Value | None = ...,
        unit: str | None = ...,
    ) -> Self: ...
    def reaction(
        self,
        name: str,
        *,
        joint: str | None = ...,
        constraint: str | None = ...,
        point: str | None = ...,
        axes: str | None = ...,
    ) -> Self: ...
    def point(
        self,
        name: str,
        body: str,
        position: Sequence[Value] | None = ...,
        *,
        given_in: str | None = ...,
    ) -> Self: ...
    def frame(
        self,
        name: str,
        body: str,
        position: Sequence[Value] | None = ...,
        *,
        rotation: Rotations | None = ...,
        orientation: Sequence[Sequence[float]] | None = ...,
        given_in: str | None = ...,
    ) -> Self: ...
    def spring(
        self,
        name: str,
        first: str,
        second: str,
        *,
        stiffness: Value | None = ...,
        damping: Value | None = ...,
        length: Value | None = ...,
        force: Value | None = ...,
    ) -> Self: ...
    def torsion_spring(
        self,
        name: str,
        first: str,
        second: str | None = ...,
        *,
        stiffness: Value | None = ...,
        damping: Value | None = ...,
        rest: Value | None = ...,
        first_index: int | None = ...,
        second_index: int | None = ...,
    ) -> Self: ...
    def tendon(
        self,
        name: str,
        points: Sequence[str],
        *,
        wraps: Sequence[Mapping[str, Any]] | None = ...,
        stiffness: Value | None = ...,
        damping: Value | None = ...,
        length: Value | None = ...,
        force: Value | None = ...,
    ) -> Self: ...
    def bushing(
        self,
        name: str,
        first: str | Mapping[str, Any],
        second: str | Mapping[str, Any],
        *,
        stiffness: Sequence[Value] | None = ...,
        damping: Sequence[Value] | None = ...,
        rotational_stiffness: Sequence[Value] | None = ...,
        rotational_damping: Sequence[Value] | None = ...,
        stiffness_matrix: Sequence[Sequence[float]] | None = ...,
        damping_matrix: Sequence[Sequence[float]] | None = ...,
        rest: Sequence[Value] | None = ...,
        rest_rotation: Rotations | None = ...,
        preload: Sequence[Value] | None = ...,
        rotational_preload: Sequence[Value] | None = ...,
    ) -> Self: ...
    def tyre(
        self,
        name: str,
        center: str,
        *,
        radius: Value,
        stiffness: Value,
        damping: Value | None = ...,
        onset: Value | None = ...,
        road: Value | None = ...,
        road_rate: Value | None = ...,
        slip: Mapping[str, Any] | None = ...,
    ) -> Self: ...
    def contact(
        self,
        name: str,
        first: str | Mapping[str, Any],
        second: str | Mapping[str, Any],
        *,
        shape: str,
        radius: Value | None = ...,
        tube_radius: Value | None = ...,
        semi_axes: Sequence[Value] | None = ...,
        surface: Value | None = ...,
        housing: str | None = ...,
        clearance: Value | None = ...,
        normal: Mapping[str, Any] | None = ...,
        tangential: Mapping[str, Any] | None = ...,
    ) -> Self: ...
    def force(
        self,
        name: str,
        body: str,
        *,
        point: Sequence[Value] | None = ...,
        force: Sequence[Value] | None = ...,
        torque: Sequence[Value] | None = ...,
        axes: str | None = ...,
        given_in: str | None = ...,
    ) -> Self: ...
    def distributed_load(
        self,
        name: str,
        beam: str,
        force: Sequence[Value],
        *,
        moment: Sequence[Value] | None = ...,
        profile: Value | Sequence[Value] | None = ...,
        axes: str | None = ...,
    ) -> Self: ...
    def effort(self, name: str, joint: str, effort: Value, *, index: int | None = ...) -> Self: ...
    def hull(
        self,
        name: str,
        body: str,
        *,
        start: Sequence[Value],
        end: Sequence[Value],
        diameter: Value,
        area: Value | None = ...,
        waves: str | None = ...,
        level: Value | None = ...,
        density: Value | None = ...,
        added_mass: Value | None = ...,
        wet: Value | None = ...,
        drag: Value | None = ...,
        axial_added_mass: Value | None = ...,
        axial_drag: Value | None = ...,
        stations: int | None = ...,
    ) -> Self: ...
    def reference(
        self,
        name: str,
        *,
        position: Mapping[str, Value] | None = ...,
        velocity: Mapping[str, Value] | None = ...,
        acceleration: Mapping[str, Value] | None = ...,
    ) -> Self: ...
    def output(
        self,
        name: str,
        *,
        position: str | None = ...,
        velocity: str | None = ...,
        acceleration: str | None = ...,
        formula: Value | Sequence[Value] | None = ...,
        reaction_force: str | None = ...,
        reaction_moment: str | None = ...,
        section_force: str | None = ...,
        section_moment: str | None = ...,
        section_strain: str | None = ...,
        section_curvature: str | None = ...,
        at: Value | None = ...,
        energy: str | None = ...,
        unit: str | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def mode(self, name: str, value: float, *, description: str | None = ...) -> Self: ...
    def event(
        self,
        name: str,
        when: Value,
        *,
        direction: str | None = ...,
        action: str | None = ...,
        reset: Mapping[str, Value] | None = ...,
        restitution: Value | None = ...,
        mode: str | None = ...,
        to: Value | None = ...,
        least_interval: Value | None = ...,
        description: str | None = ...,
    ) -> Self: ...
    def shape(
        self,
        name: str,
        type: str,
        body: str,
        *,
        position: Sequence[Value] | None = ...,
        rotation: Rotations | None = ...,
        axis: Sequence[Value] | None = ...,
        given_in: str | None = ...,
        first: str | None = ...,
        second: str | None = ...,
        size: Sequence[Value] | None = ...,
        radius: Value | None = ...,
        length: Value | None = ...,
        width: Value | None = ...,
        semi_axes: Sequence[Value] | None = ...,
        file: str | None = ...,
        scale: Value | Sequence[Value] | None = ...,
        color: str | None = ...,
        opacity: float | None = ...,
        required: bool | None = ...,
    ) -> Self: ...
    def doubts(self, *, quiet: Sequence[str] | None = ..., strict: bool | None = ...) -> Self: ...

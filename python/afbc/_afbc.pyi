"""Types of the compiled part. Frames: earth z up; body x forward, y left, z up. Names end in their SI units."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any, Self, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "AfbcError",
    "__version__",
    "State",
    "Setpoint",
    "Vehicle",
    "Scenario",
    "Flight",
    "Controller",
    "Action",
    "Plant",
    "Batch",
    "OwnVehicle",
    "Estimator",
    "Instruments",
    "FlightCore",
    "Guidance",
    "fly",
    "compare",
    "campaign",
    "merge",
    "tune",
    "replay",
    "register",
    "laws",
    "vehicles",
    "scenarios",
    "campaigns",
]

__version__: str

_Array = NDArray[np.float64]
_Path = str | PathLike[str]
_Progress = Callable[[int], object] | None

class AfbcError(ValueError):
    """Bad input, described as on the command line: file, place and cure, with a line for each mistake of a file."""

@final
class State:
    """Measured motion: position, velocity (earth), Euler angles roll, pitch, yaw (z-y-x), body rates."""

    def __new__(
        cls,
        position_m: ArrayLike = ...,
        velocity_m_s: ArrayLike = ...,
        attitude_rad: ArrayLike = ...,
        rates_rad_s: ArrayLike = ...,
    ) -> Self: ...
    @property
    def position_m(self) -> _Array: ...
    @property
    def velocity_m_s(self) -> _Array: ...
    @property
    def attitude_rad(self) -> _Array: ...
    @property
    def rates_rad_s(self) -> _Array: ...
    @property
    def vector(self) -> _Array:
        """All twelve numbers in this order, shape (12,)."""

@final
class Setpoint:
    """Desired motion in the earth frame: position with four derivatives, heading with two."""

    def __new__(
        cls,
        position_m: ArrayLike = ...,
        velocity_m_s: ArrayLike = ...,
        acceleration_m_s2: ArrayLike = ...,
        jerk_m_s3: ArrayLike = ...,
        snap_m_s4: ArrayLike = ...,
        yaw_rad: float = 0.0,
        yaw_rate_rad_s: float = 0.0,
        yaw_acceleration_rad_s2: float = 0.0,
    ) -> Self: ...
    @property
    def position_m(self) -> _Array: ...
    @property
    def velocity_m_s(self) -> _Array: ...
    @property
    def acceleration_m_s2(self) -> _Array: ...
    @property
    def jerk_m_s3(self) -> _Array: ...
    @property
    def snap_m_s4(self) -> _Array: ...
    @property
    def yaw_rad(self) -> float: ...
    @property
    def yaw_rate_rad_s(self) -> float: ...
    @property
    def yaw_acceleration_rad_s2(self) -> float: ...

@final
class Vehicle:
    """A vehicle: a built-in one by name, or one from a file by path."""

    def __new__(cls, name: _Path) -> Self: ...
    @staticmethod
    def from_toml(text: str, name: str = "vehicle") -> Vehicle: ...
    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def rotors(self) -> int: ...
    @property
    def rotor_force_max_n(self) -> float: ...
    @property
    def lag_s(self) -> float: ...
    @property
    def rotor_positions_m(self) -> _Array: ...
    @property
    def rotor_yaw_signs(self) -> _Array: ...
    @property
    def rotor_speed_limits_rad_s(self) -> tuple[float, float]: ...
    @property
    def drag(self) -> dict[str, Any] | None: ...
    @property
    def parameters(self) -> dict[str, Any]: ...

@final
class Scenario:
    """A vehicle, trajectory, environment and the contenders to compare: built in by name, or from a file by path."""

    def __new__(cls, name: _Path) -> Self: ...
    @staticmethod
    def from_toml(text: str, name: str = "scenario") -> Scenario: ...
    def replace(
        self, *, vehicle: Vehicle | _Path | None = None, seed: int | None = None, duration_s: float | None = None
    ) -> Scenario: ...
    @property
    def name(self) -> str: ...
    @property
    def description(self) -> str: ...
    @property
    def duration_s(self) -> float: ...
    @property
    def seed(self) -> int: ...
    @property
    def rotors(self) -> int: ...
    @property
    def contenders(self) -> list[str]: ...
    @property
    def parameters(self) -> dict[str, Any]: ...
    @property
    def polynomials(self) -> list[tuple[float, float, _Array]] | None:
        """Start [s], length [s] and coefficients, shape (4, 8), of each piece of a polynomial path."""
    def reference(self, time_s: ArrayLike) -> dict[str, _Array]:
        """Returns the reference at these times [s]: a column for each coordinate and derivative."""

@final
class Flight:
    """One flight under one contender."""

    @property
    def contender(self) -> str: ...
    @property
    def scenario(self) -> str: ...
    @property
    def lost(self) -> tuple[float, str] | None: ...
    @property
    def tripped(self) -> tuple[float, str] | None: ...
    @property
    def metrics(self) -> dict[str, float | None]: ...
    @property
    def columns(self) -> dict[str, _Array]: ...
    def __getitem__(self, column: str, /) -> _Array: ...
    def __len__(self) -> int: ...

@final
class Action:
    """Result of a controller's step."""

    @property
    def speeds_rad_s(self) -> _Array: ...
    @property
    def forces_n(self) -> _Array: ...
    @property
    def inputs_n(self) -> _Array: ...
    @property
    def saturated(self) -> bool: ...
    @property
    def state_rejected(self) -> bool: ...
    @property
    def setpoint_rejected(self) -> bool: ...
    @property
    def fallback(self) -> str | None: ...

@final
class Controller:
    """A control law on a vehicle, step by step. It is the same code that flies on a board."""

    def __new__(
        cls,
        law: str = "afbc",
        vehicle: Vehicle | _Path | None = None,
        *,
        profile: str = "flight",
        monitored: bool = False,
        gains: Mapping[str, float] | Sequence[tuple[str, float]] | None = None,
    ) -> Self: ...
    @property
    def law(self) -> str: ...
    @property
    def dt_s(self) -> float: ...
    @property
    def gains(self) -> dict[str, float]: ...
    @property
    def trace(self) -> dict[str, Any]: ...
    def step(self, state: State | None, setpoint: Setpoint) -> Action: ...
    def reset(self) -> None: ...

@final
class Plant:
    """The world of a scenario without its controllers."""

    def __new__(
        cls,
        scenario: Scenario | _Path | None = None,
        *,
        vehicle: Vehicle | _Path | None = None,
        seed: int | None = None,
        dt_s: float = 0.001,
    ) -> Self: ...
    def step(self, speeds_rad_s: ArrayLike) -> None: ...
    def reset(self, seed: int | None = None, state: State | None = None) -> None: ...
    @property
    def time_s(self) -> float: ...
    @property
    def dt_s(self) -> float: ...
    @property
    def state(self) -> State | None: ...
    @property
    def true_state(self) -> State: ...
    @property
    def true_vector(self) -> _Array: ...
    @property
    def setpoint(self) -> Setpoint: ...
    @property
    def rotor_speeds_rad_s(self) -> _Array: ...
    @property
    def specific_force_m_s2(self) -> _Array: ...
    @property
    def wind_m_s(self) -> _Array: ...
    @property
    def on_ground(self) -> bool: ...

@final
class Batch:
    """Simulated worlds of one scenario with consecutive seeds, stepped together on all cores without the GIL."""

    def __new__(
        cls,
        count: int,
        scenario: Scenario | _Path | None = None,
        *,
        vehicle: Vehicle | _Path | None = None,
        seed: int | None = None,
        dt_s: float = 0.001,
    ) -> Self: ...
    def __len__(self) -> int: ...
    def step(self, speeds_rad_s: ArrayLike, steps: int = 1) -> None: ...
    def reset(self, index: int, seed: int, state: State | None = None) -> None: ...
    @property
    def time_s(self) -> _Array: ...
    @property
    def states(self) -> _Array: ...
    @property
    def true_states(self) -> _Array: ...
    @property
    def references(self) -> _Array: ...

@final
class OwnVehicle:
    """Data of the vehicle that a user's law flies."""

    @property
    def mass_kg(self) -> float: ...
    @property
    def gravity_m_s2(self) -> float: ...
    @property
    def arm_m(self) -> float: ...
    @property
    def thrust_factor_n_s2(self) -> float: ...
    @property
    def drag_factor_n_m_s2(self) -> float: ...
    @property
    def inertia_kg_m2(self) -> _Array: ...
    @property
    def effectiveness(self) -> _Array: ...
    @property
    def rotors(self) -> int: ...
    @property
    def rotor_force_max_n(self) -> float: ...
    @property
    def dt_s(self) -> float: ...
    @property
    def gains(self) -> dict[str, float]: ...

@final
class Estimator:
    """Estimates position, velocity, attitude and biases from an inertial sensor and other measurements. Times in s."""

    def __new__(cls) -> Self: ...
    def pose(
        self,
        at_s: float,
        position_m: ArrayLike,
        attitude: ArrayLike,
        position_sigma_m: float = 0.001,
        attitude_sigma_rad: float = 0.01,
    ) -> None: ...
    def gnss(
        self,
        at_s: float,
        position_m: ArrayLike,
        velocity_m_s: ArrayLike,
        horizontal_sigma_m: float = 1.5,
        vertical_sigma_m: float = 3.0,
        speed_sigma_m_s: float = 0.2,
        climb_sigma_m_s: float = 0.3,
    ) -> None: ...
    def height(self, at_s: float, height_m: float, sigma_m: float = 0.1) -> None: ...
    def magnetic_field(self, at_s: float, field: ArrayLike, sigma: float) -> None: ...
    def heading(self, at_s: float, heading_rad: float, sigma_rad: float = 0.05) -> None: ...
    def set_on_ground(self, on_ground: bool) -> None: ...
    def step(
        self, now_s: float, rates_rad_s: ArrayLike | None = None, specific_force_m_s2: ArrayLike | None = None
    ) -> State: ...
    @property
    def state(self) -> State: ...
    @property
    def attitude(self) -> _Array: ...
    @property
    def biases(self) -> dict[str, Any]: ...
    @property
    def sigmas(self) -> dict[str, Any]: ...
    @property
    def valid(self) -> dict[str, bool]: ...
    @property
    def unready(self) -> str | None: ...

@final
class Instruments:
    """Instruments of a scenario's vehicle, with their errors, delays and failures. They can measure any plant."""

    def __new__(
        cls,
        scenario: Scenario | _Path | None = None,
        *,
        vehicle: Vehicle | _Path | None = None,
        seed: int | None = None,
        dt_s: float = 0.001,
    ) -> Self: ...
    def measure(self, plant: Plant) -> dict[str, Any]: ...

@final
class FlightCore:
    """The firmware's flight core around a control law, tick by tick at 1 kHz: arming, flight, coasting, descent."""

    def __new__(
        cls,
        law: str = "afbc",
        vehicle: Vehicle | _Path | None = None,
        *,
        monitored: bool = True,
        gains: Mapping[str, float] | Sequence[tuple[str, float]] | None = None,
    ) -> Self: ...
    def request(self, request: str) -> None: ...
    def step(
        self, state: State | None = None, setpoint: Setpoint | None = None, *, idle_on_ground: bool = False
    ) -> Action: ...
    @property
    def time_s(self) -> float: ...
    @property
    def mode(self) -> str: ...
    @property
    def answer(self) -> str | None: ...
    @property
    def against(self) -> list[str]: ...
    @property
    def ended(self) -> str | None: ...
    @property
    def airborne(self) -> bool: ...
    @property
    def rested(self) -> bool: ...

@final
class Guidance:
    """The firmware's flight modes, trajectory limiter and safety net, step by step."""

    def __new__(cls, vehicle: Vehicle | _Path | None = None, *, dt_s: float = 0.001) -> Self: ...
    def take_off(self, height_m: float | None = None) -> None: ...
    def go_to(self, position_m: ArrayLike, yaw_rad: float | None = None, speed_m_s: float | None = None) -> None: ...
    def select(self, mode: str) -> None: ...
    def sticks(self, roll: float, pitch: float, yaw: float, throttle: float) -> None: ...
    def step(
        self,
        state: State | None,
        core: str = "flying",
        *,
        airborne: bool = True,
        rested: bool = True,
        thrust_m_s2: float | None = None,
    ) -> Setpoint | None: ...
    @property
    def mode(self) -> str: ...
    @property
    def answer(self) -> str | None: ...
    @property
    def idle_on_ground(self) -> bool: ...
    @property
    def request(self) -> str | None: ...
    @property
    def failsafe(self) -> str | None: ...

def _flight(told: tuple[Any, ...], columns: dict[str, _Array]) -> Flight: ...
def _scenario(file: str, text: str, name: str, changes: list[tuple[Any, ...]]) -> Scenario: ...
def _vehicle(file: str, text: str, name: str) -> Vehicle: ...
def laws() -> list[str]: ...
def vehicles() -> list[str]: ...
def scenarios() -> list[str]: ...
def campaigns() -> list[str]: ...
def register(
    name: str,
    make: Callable[[OwnVehicle], Any],
    *,
    title: str | None = None,
    gains: Sequence[tuple[str, tuple[float, float, float]]] | None = None,
) -> None: ...
def fly(
    scenario: Scenario | _Path,
    controllers: Sequence[str] | None = None,
    *,
    vehicle: Vehicle | _Path | None = None,
    seed: int | None = None,
    duration_s: float | None = None,
    log_hz: int | None = None,
    threads: int | None = None,
    progress: _Progress = None,
) -> dict[str, Flight]: ...
def compare(
    scenarios: Sequence[Scenario | _Path],
    controllers: Sequence[str] | None = None,
    *,
    vehicle: Vehicle | _Path | None = None,
    seeds: int | None = None,
    threads: int | None = None,
    progress: _Progress = None,
) -> dict[str, Any]: ...
def campaign(
    campaign: _Path,
    *,
    flights: int | None = None,
    vehicle: Vehicle | _Path | None = None,
    shard: str | None = None,
    out: _Path | None = None,
    threads: int | None = None,
    progress: _Progress = None,
) -> dict[str, Any]: ...
def merge(shards: Sequence[_Path], out: _Path) -> dict[str, Any]: ...
def tune(
    law: str,
    scenarios: Sequence[Scenario | _Path] | None = None,
    *,
    vehicle: Vehicle | _Path | None = None,
    budget: int = 1000,
    seed: int = 1,
    step: float = ...,
    flying: bool = False,
    threads: int | None = None,
    progress: _Progress = None,
) -> dict[str, Any]: ...
def replay(log: _Path) -> dict[str, _Array]: ...

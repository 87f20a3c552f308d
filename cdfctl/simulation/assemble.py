"""From a scenario to a closed loop: the only place that wires robot, motion, controller, plant and judge."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

from cdfctl.control.controller import build
from cdfctl.errors import InputError
from cdfctl.robots.robot import Robot
from cdfctl.scenario.draws import UndrawableError, sources
from cdfctl.scenario.library import ScenarioFile
from cdfctl.scenario.plant import FrankaConfig, KinematicConfig, MujocoConfig
from cdfctl.scenario.problems import path_text
from cdfctl.scenario.resolve import resolve
from cdfctl.scenario.schema import ReachTask, Scenario
from cdfctl.scenario.values import Complaint, Place
from cdfctl.scenario.variants import VARIANTS
from cdfctl.simulation.checks import robot_complaints, robot_of, scenario_complaints
from cdfctl.simulation.drawing import draw_trial
from cdfctl.simulation.goals import Goal, Touch, goal_of
from cdfctl.simulation.judge import judge
from cdfctl.simulation.measurement import OBSTACLES, TARGET, Sensor
from cdfctl.simulation.motion import SceneMotion
from cdfctl.simulation.plants import Plant
from cdfctl.simulation.plants.kinematic import KinematicPlant
from cdfctl.simulation.plants.paced import PacedPlant
from cdfctl.simulation.result import RunResult
from cdfctl.simulation.rollout import Rollout, Step
from cdfctl.simulation.shapes import vector_of
from cdfctl.simulation.stream.guard import Guard
from cdfctl.simulation.stream.motion import MeasuredMotion


@dataclass
class Trial:
    """One set-up, wired and ready to run once.

    Attributes:
        scenario: as resolved, every default and draw written out.
        trial: which draw of the scenario's seed it is.
        robot: the robot.
        motion: the obstacles over time.
        rollout: the closed loop.
        guard: what watches over measured obstacles; None where they are not measured.
    """

    scenario: Scenario
    trial: int
    robot: Robot
    motion: SceneMotion
    rollout: Rollout
    guard: Guard | None = None

    def run(self) -> Generator[Step]:
        """Run the closed loop, yielding after every control step; it may be left early."""
        try:
            yield from self.rollout.steps()
        finally:
            self.motion.close()

    def result(self) -> RunResult:
        """What the steps so far come to, judged: all of them after :meth:`run`, or those before an interrupt."""
        trajectory = self.rollout.trajectory()
        return RunResult(
            scenario=self.scenario,
            robot=self.robot.name,
            trial=self.trial,
            trajectory=trajectory,
            verdict=judge(
                self.robot,
                self.motion.settled(),
                trajectory,
                self.rollout.stop,
                self_collision=bool(self.scenario.controller.self_collision),
            ),
            stop=self.rollout.stop,
            reason=self.rollout.reason,
            plant=self.rollout.plant.report(),
            measured=self.guard.report() if self.guard is not None else None,
        )


def assemble(file: ScenarioFile, *, trial: int = 0, robot: Robot | None = None) -> Trial:
    """The trial ``trial`` of a scenario file, drawn, resolved and checked.

    Args:
        file: from :func:`cdfctl.scenario.library.load_scenario`.
        trial: which draw of the scenario's seed.
        robot: the scenario's robot where it is at hand (a benchmark loads it once), None to load it.

    Raises:
        ScenarioErrors: everything about the scenario that does not fit the robot, each at its place in the file.
        MissingError: something the scenario needs is not installed.
    """
    file.check_runnable()
    try:
        robot = robot if robot is not None else _load(file.scenario)
        return _assemble(resolve(draw_trial(file.scenario, trial, robot)), trial, robot)
    except UndrawableError as error:
        raise file.errors([file.located(error.place, error.message, error.hint)]) from None
    except _MisfitError as misfit:
        found = {file.located(_in_file(file.scenario, place), m, hint) for m, hint, place in misfit.complaints}
        raise file.errors(list(found)) from None


def assemble_scenario(scenario: Scenario, *, trial: int = 0, robot: Robot | None = None) -> Trial:
    """The same for a scenario that is drawn and resolved already and has no file to point into.

    Raises:
        InputError: everything about the scenario that does not fit the robot, one line each.
    """
    try:
        return _assemble(scenario, trial, robot if robot is not None else _load(scenario))
    except _MisfitError as misfit:
        raise misfit.as_input_error() from None


class _MisfitError(Exception):
    def __init__(self, complaints: Sequence[Complaint]) -> None:
        super().__init__(complaints)
        self.complaints = complaints

    def as_input_error(self) -> InputError:
        lines = [f"{path_text(place)}: {message}" for message, _, place in self.complaints]
        hints = [hint for _, hint, _ in self.complaints if hint]
        return InputError("\n".join(lines), hints[0] if len(lines) == 1 and hints else None)


def _load(scenario: Scenario) -> Robot:
    try:
        return robot_of(scenario.robot)
    except InputError as error:
        raise _MisfitError(robot_complaints(scenario.robot, error)) from None


def _in_file(scenario: Scenario, place: Place) -> Place:
    """A place in a drawn scenario as one in the file, where a group is one item."""
    match place:
        case ("obstacles", int(i), *rest):
            return ("obstacles", sources(scenario)[i], *rest)
        case _:
            return place


def _assemble(scenario: Scenario, trial: int, robot: Robot) -> Trial:
    complaints = [*plant_complaints(scenario, robot), *scenario_complaints(scenario, robot)]
    if complaints:
        raise _MisfitError(complaints)
    simulation = scenario.simulation
    motion, guard = SceneMotion(scenario.obstacles), None
    if scenario.feed is not None:
        motion = MeasuredMotion(scenario.obstacles, scenario.feed)
    config, measurement = scenario.controller, scenario.measurement
    if VARIANTS[config.variant].plans and measurement.compensate_delay and measurement.delay > 0.0:
        # It makes up for the delay itself, with velocities that it has corrected.
        config = config.model_copy(update={"delay": measurement.delay})
        measurement = measurement.model_copy(update={"compensate_delay": False})
    controller = build(robot, config, scenario.task, simulation.dt, motion)
    target: SceneMotion | None = None
    goal: Goal
    if isinstance(scenario.task, ReachTask):
        target = SceneMotion((scenario.task.target,))
        assert controller.reaching is not None  # build() has seen the same task
        assert scenario.controller.reach_tolerance is not None  # and the scenario is resolved
        goal = Touch(controller.reaching, target, scenario.controller.reach_tolerance)
    else:
        goal = goal_of(scenario.task, robot, simulation.tolerance)
    plant = plant_of(scenario, robot, motion)
    if isinstance(motion, MeasuredMotion):
        guard = Guard(controller, motion)
        plant = plant if isinstance(scenario.plant, FrankaConfig) else PacedPlant(plant)
    errors = measurement, scenario.seed, trial
    rollout = Rollout(
        guard if guard is not None else controller,
        plant,
        motion,
        goal,
        vector_of(scenario.robot.q0),
        dt=simulation.dt,
        time_limit=simulation.time_limit,
        sensor=Sensor(motion, *errors, OBSTACLES),
        target=None if target is None else Sensor(target, *errors, TARGET),
    )
    return Trial(scenario, trial, robot, motion, rollout, guard)


def plant_of(scenario: Scenario, robot: Robot, motion: SceneMotion) -> Plant:
    """The plant of the scenario's plant section, with its heavy imports.

    Raises:
        MissingError: its extra is not installed.
        InputError: it cannot do what the scenario asks of it, or not with this robot.
    """
    match scenario.plant:
        case KinematicConfig():
            return KinematicPlant()
        case MujocoConfig():
            from cdfctl.simulation.plants.mujoco import MujocoPlant

            return MujocoPlant(robot, motion, scenario.plant, scenario.simulation.dt)
        case FrankaConfig():
            from cdfctl.simulation.plants.franka.approach import SlowApproach
            from cdfctl.simulation.plants.franka.arm import connect
            from cdfctl.simulation.plants.franka.plant import FrankaPlant

            approach = SlowApproach(scenario, robot, motion, scenario.plant.approach_speed)
            return FrankaPlant(scenario.plant, robot, scenario.simulation.dt, connect, approach)


def plant_complaints(scenario: Scenario, robot: Robot) -> list[Complaint]:
    """What the scenario asks that its plant cannot do, as far as it is known before the run."""
    match scenario.plant:
        case FrankaConfig():
            from cdfctl.simulation.plants.franka.limits import complaints
            from cdfctl.simulation.plants.franka.plant import hold_of

            dt = scenario.simulation.dt
            return [*complaints(scenario.plant, robot, dt, hold_of(scenario.plant, dt))]
        case _:
            return []

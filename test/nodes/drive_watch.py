# SPDX-FileCopyrightText: 2026 The antenna_drive authors
# SPDX-License-Identifier: Apache-2.0
"""What the tests of the nodes see of a running drive: its reports, its parameters, its samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from threading import Event, Thread
import time
from types import TracebackType
from typing import Any

from antenna_drive.emulator.unit import FloatArray, Signal
from antenna_drive.emulator.wiring import OUTPUTS
from antenna_drive.lockstep.leaving import leave
from antenna_drive.lockstep.observer import Observer
from antenna_drive.lockstep.ros_link import FRAME_QOS
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import numpy as np
from rcl_interfaces.msg import SetParametersResult
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from std_msgs.msg import Float64, Float64MultiArray
from std_srvs.srv import Trigger

# A hang is a failure; nothing is judged by how long it took.
PATIENCE_S = 120.0


class Watch:
    """A ROS 2 node of the test's own."""

    def __init__(self, namespace: str = '', domain_id: int | None = None) -> None:
        context = Context()
        context.init(args=[], domain_id=domain_id)
        self.node = Node('watch', namespace=namespace, context=context)
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.node)
        self.reports: dict[str, DiagnosticStatus] = {}
        self.heard: list[DiagnosticStatus] = []
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._report, 100)

    def _report(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.reports[status.name.rpartition('/')[2]] = status
            self.heard.append(status)

    def __enter__(self) -> Watch:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        self.executor.shutdown()
        leave(self.node)

    def until(self, true: Callable[[], bool], what: str) -> None:
        """Serve this node until something is true."""
        deadline = time.monotonic() + PATIENCE_S
        while not true():
            assert time.monotonic() < deadline, f'in vain: {what}; {self.told()}'
            self.executor.spin_once(timeout_sec=0.1)

    def told(self) -> dict[str, str]:
        """Return what each node last said of itself."""
        return {name: status.message for name, status in self.reports.items()}

    def value(self, name: str, key: str) -> str:
        """Return one value of a node's last report, '' if it is not there."""
        status = self.reports.get(name)
        if status is None:
            return ''
        return next((item.value for item in status.values if item.key == key), '')

    def _answer(self, future: Any, name: str) -> Any:
        self.until(future.done, f'the answer of {name}')
        return future.result()

    def call(self, service: str) -> Trigger.Response:
        """Call a service of the run control."""
        client: Any = self.node.create_client(Trigger, service)
        self.until(client.service_is_ready, service)
        return self._answer(client.call_async(Trigger.Request()), service)

    def set_together(self, name: str, values: Mapping[str, Any]) -> SetParametersResult:
        """Set parameters of a node, all or none."""
        client = AsyncParameterClient(self.node, name)
        assert client.wait_for_services(PATIENCE_S)
        future = client.set_parameters_atomically(
            [Parameter(key, value=value) for key, value in values.items()])
        return self._answer(future, name).result

    def get(self, name: str, *keys: str) -> list[Any]:
        """Return parameters of a node."""
        client = AsyncParameterClient(self.node, name)
        assert client.wait_for_services(PATIENCE_S)
        future = client.get_parameters(list(keys))
        return [Parameter.from_parameter_msg(
            _message(key, value)).value
            for key, value in zip(keys, self._answer(future, name).values)]

    def describe(self, name: str, *keys: str) -> list[Any]:
        """Return descriptors of parameters of a node."""
        client = AsyncParameterClient(self.node, name)
        assert client.wait_for_services(PATIENCE_S)
        future = client.describe_parameters(list(keys))
        return list(self._answer(future, name).descriptors)

    def publish_frames(self, topic: str, frames: list[list[float]], readers: int) -> None:
        """Publish frames that are none of ours."""
        publisher = self.node.create_publisher(Float64MultiArray, topic, FRAME_QOS)
        self.until(lambda: publisher.get_subscription_count() >= readers, 'readers')
        for data in frames:
            publisher.publish(Float64MultiArray(data=data))

    def float_publisher(self, topic: str) -> Callable[[float], None]:
        """Return a function that publishes a number, once somebody reads it."""
        publisher = self.node.create_publisher(Float64, topic, 10)
        self.until(lambda: publisher.get_subscription_count() >= 1, 'a reader')
        return lambda value: publisher.publish(Float64(data=value))


class Recorder:
    """Every sample and every change of a drive, gathered in a thread."""

    def __init__(self, name: str = 'watcher', namespace: str = '',
                 outputs: Mapping[str, Sequence[Signal]] = OUTPUTS) -> None:
        self.samples: list[FloatArray] = []
        self.changes: list[tuple[str, Mapping[str, Any]]] = []
        self.runs: list[int] = []
        self.step_s = 0.0
        self.first = 0
        self._stop = Event()
        self.observer = Observer(name, self._keep, on_begin=self._begin,
                                 on_change=self._note, namespace=namespace,
                                 outputs=outputs)
        self._thread = Thread(target=self.observer.spin, args=(self._stop.is_set,))
        self._thread.start()

    def _begin(self, run: int, step_s: float) -> None:
        self.samples.clear()
        self.step_s = step_s
        self.runs.append(run)

    def _keep(self, step: int, time_s: float, samples: FloatArray) -> None:
        if not self.samples:
            self.first = step
        assert step == self.first + len(self.samples)
        self.samples.append(samples.copy())

    def _note(self, unit: str, record: Mapping[str, Any]) -> None:
        self.changes.append((unit, record))

    @property
    def steps(self) -> int:
        """Return the number of complete steps of the run in progress."""
        return len(self.samples) - 1

    def array(self) -> FloatArray:
        """Return the samples of the run."""
        return np.array(self.samples)

    def schedule(self) -> dict[int, dict[str, dict[str, Any]]]:
        """Return the changes of the last run as the in-process emulator takes them."""
        schedule: dict[int, dict[str, dict[str, Any]]] = {}
        for unit, record in self.changes:
            if record['run'] == self.runs[-1] and 'changes' in record:
                at_step = schedule.setdefault(record['step'], {})
                at_step.setdefault(unit, {}).update(record['changes'])
        return schedule

    def close(self) -> None:
        """Leave the drive."""
        self._stop.set()
        self._thread.join()
        self.observer.close()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        self.close()


def _message(name: str, value: Any) -> Any:
    from rcl_interfaces.msg import Parameter as ParameterMessage
    return ParameterMessage(name=name, value=value)

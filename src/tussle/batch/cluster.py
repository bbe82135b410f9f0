"""A batch on several machines: who plays it on a Dask cluster, and how one is reached."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from tussle.batch.cluster_course import Course
from tussle.batch.tasks import Beat, Finished, Package, Run
from tussle.errors import BatchError, MissingExtraError, ParameterError

Client = Any
"""That of `distributed`, which annotates a part of itself."""


def missing_extra(package: str) -> MissingExtraError:
    """What to do where a package of the extra is not installed."""
    return MissingExtraError(
        f"several machines need {package}, which is not installed: pip install 'tussle[cluster]'"
    )


@contextmanager
def connect(address: str, timeout: float = 10.0) -> Iterator[Client]:
    """A client of the Dask scheduler at an address, such as "tcp://node1:8786".

    Args:
        address: Where it listens.
        timeout: How long to wait for it [s].

    Raises:
        BatchError: Nobody answers there.
        MissingExtraError: Dask is not installed.
    """
    try:
        import distributed
    except ImportError:
        raise missing_extra("distributed") from None
    try:
        client: Any = distributed.Client(address, timeout=timeout, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TypeError) as error:
        reason = f"within {timeout:g} s" if isinstance(error, TimeoutError | OSError) else f"({error})"
        raise BatchError(
            f"{address}: no Dask scheduler answers {reason}; `dask scheduler` starts one and says its address"
        ) from None
    try:
        yield client
    finally:
        client.close()


class OnDask:
    """Plays on the workers of a Dask cluster, one stack at a time on each: start them with one thread.

    The runs of a worker that is lost are played again elsewhere. Those over which workers die again and again are played one by one, and
    one that goes on so is recorded as failed.

    Args:
        client: Of the cluster.
        stack: Worlds side by side; None chooses by the mission.
        n_workers: Workers that are expected, where they come one by one.
        patience: How long to wait while there is no worker [s]; None is for ever.
        look: Called now and then while there is no worker, with how long there has been none [s]; raises where none can come.

    Raises:
        ParameterError: The client is asynchronous.
    """

    def __init__(
        self,
        client: Client,
        stack: int | None = None,
        *,
        n_workers: int = 0,
        patience: float | None = 60.0,
        look: Callable[[float], None] | None = None,
    ) -> None:
        if client.asynchronous:
            raise ParameterError("the client is asynchronous; a batch takes Client(..., asynchronous=False)")
        self.client, self.stack, self.n_workers = client, stack, n_workers
        self.patience, self.look = patience, look

    def play(self, package: Package, runs: Sequence[Run]) -> Generator[Finished | Beat, None, None]:
        """What comes of the runs.

        Raises:
            ParameterError: Runs are to take only so long.
            BatchError: The scheduler or all workers are gone, or a worker cannot play this batch.
        """
        if package.run_timeout is not None:
            raise ParameterError(
                "run_timeout is for processes of this machine; on a cluster, limit the time of the jobs"
            )
        course = Course(package, runs, self.client, self.stack, self.n_workers, self.patience, self.look)
        try:
            yield from course.play()
        finally:
            course.stop()

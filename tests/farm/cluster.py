"""A cluster of Slurm on this machine: a controller, three nodes, and the service that signs their messages, all in one folder."""

import os
import pathlib
import shutil
import signal
import subprocess
import time

COMMANDS = ("slurmctld", "slurmd", "sbatch", "squeue", "scontrol", "sinfo", "srun", "munged")
NODES = ("n1", "n2", "n3")
FIRST_PORT = 17_820
# Failures are noticed in seconds rather than minutes.
CONFIGURATION = """\
ClusterName=bansho
SlurmctldHost=localhost
SlurmctldPort={controller_port}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=5
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/controller.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/controller.log
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
MpiDefault=none
SwitchType=switch/none
MessageTimeout=2
TCPTimeout=1
SlurmdTimeout=5
KillWait=2
ReturnToService=2
MinJobAge=300
SchedulerParameters=sched_interval=1,sched_min_interval=0
NodeName=n[1-3] NodeHostname=localhost NodeAddr=127.0.0.1 Port=[{port}-{last_port}] CPUs=1 RealMemory=4000 State=UNKNOWN
PartitionName=all Nodes=n[1-3] Default=YES MaxTime=INFINITE State=UP
"""


def why_not() -> str | None:
    """Why no cluster can run here; None where it can."""
    missing = [name for name in COMMANDS if not shutil.which(name)]
    if missing:
        return f"needs {', '.join(missing)}"
    return None if os.geteuid() == 0 else "needs root, as whom the daemons of Slurm run"


class Cluster:
    """Started by `with`, and stopped again."""

    def __init__(self, folder: pathlib.Path):
        self.folder = folder
        self.environment = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}

    def run(self, *line: str) -> str:
        """A command of Slurm, which must succeed."""
        done = subprocess.run(line, env=self.environment, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(f"{' '.join(line)}: {done.stderr or done.stdout}")
        return done.stdout

    def __enter__(self) -> "Cluster":
        self.folder.mkdir(parents=True)
        self.folder.chmod(0o755)
        for name in ("state", *(f"spool.{node}" for node in NODES)):
            (self.folder / name).mkdir()
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(1024))
        key.chmod(0o600)
        configuration = CONFIGURATION.format(
            folder=self.folder, controller_port=FIRST_PORT - 1, port=FIRST_PORT, last_port=FIRST_PORT + len(NODES) - 1
        )
        (self.folder / "slurm.conf").write_text(configuration)
        paths = {"key-file": "munge.key", "socket": "munge.socket", "pid-file": "munged.pid", "log-file": "munged.log", "seed-file": "munged.seed"}
        self.run("munged", "--force", *(f"--{option}={self.folder / name}" for option, name in paths.items()))
        self.run("slurmctld", "-i", "-f", str(self.folder / "slurm.conf"))
        for node in NODES:
            self.start_node(node)
        self.wait("all nodes are idle", lambda: self.run("sinfo", "-h", "-o", "%T %D").split() == ["idle", "3"], 60)
        return self

    def __exit__(self, *_: object) -> None:
        subprocess.run(["scancel", "--user=root", "--signal=KILL"], env=self.environment, capture_output=True)
        for name in (*(f"{node}.pid" for node in NODES), "controller.pid", "munged.pid"):
            try:
                os.kill(int((self.folder / name).read_text()), signal.SIGTERM)
            except (OSError, ValueError):
                pass
        time.sleep(1)

    def start_node(self, node: str, *wrapper: str) -> None:
        """Starts the daemon of a node, where it is not running. `wrapper` is run with its command line behind it."""
        self.run(*wrapper, "slurmd", "-N", node, "-f", str(self.folder / "slurm.conf"))

    def stop_node(self, node: str) -> None:
        """Ends the daemon of a node in good order."""
        os.kill(int((self.folder / f"{node}.pid").read_text()), signal.SIGTERM)
        time.sleep(1)

    def kill_node(self, node: str) -> None:
        """What the loss of a machine is: its daemon and all that runs there end at once."""
        os.kill(int((self.folder / f"{node}.pid").read_text()), signal.SIGKILL)
        for process in self.processes_of(node):
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                pass

    def kill_program(self, node: str, program: str) -> None:
        """Ends `program` on a node at once, and nothing else."""
        for process in self.processes_of(node):
            if os.readlink(f"/proc/{process}/exe") == program:
                os.kill(process, signal.SIGKILL)

    def processes_of(self, node: str) -> list[int]:
        """Processes of jobs on a node, which know its name; and what supervises them."""
        found = []
        for entry in pathlib.Path("/proc").iterdir():
            if not entry.name.isdigit():
                continue
            try:
                variables = (entry / "environ").read_bytes().split(b"\0")
                command = (entry / "cmdline").read_bytes()
            except OSError:
                continue
            ours = f"SLURM_CONF={self.environment['SLURM_CONF']}".encode() in variables
            on_node = f"SLURMD_NODENAME={node}".encode() in variables
            supervises = command.startswith(b"slurmstepd") and self.supervises(int(entry.name), node)
            if ours and on_node or supervises:
                found.append(int(entry.name))
        return found

    def supervises(self, process: int, node: str) -> bool:
        """Whether a `slurmstepd` has its log or its socket in the spool of a node of this cluster."""
        for link in pathlib.Path(f"/proc/{process}/fd").iterdir():
            try:
                target = os.readlink(link)
            except OSError:
                continue
            if target.startswith((str(self.folder / f"spool.{node}"), str(self.folder / f"{node}.log"))):
                return True
        return False

    def running(self) -> list[tuple[str, str]]:
        """Tasks of arrays that run, each with its node."""
        lines = self.run("squeue", "-h", "-t", "RUNNING", "-o", "%i %N").splitlines()
        return [(job, node) for job, node in map(str.split, lines) if "_" in job]

    def wait_for_tasks_on(self, *nodes: str) -> dict[str, str]:
        """Waits until tasks run on all these nodes; the task of each."""
        tasks: dict[str, str] = {}

        def run_on_all() -> bool:
            tasks.clear()
            tasks.update({node: job for job, node in self.running()})
            return all(node in tasks for node in nodes)

        self.wait(f"tasks run on {', '.join(nodes)}", run_on_all, 120)
        return tasks

    def queued(self) -> list[str]:
        """Jobs and tasks of arrays that are queued, running or about to end."""
        return self.run("squeue", "-h", "-r", "-o", "%i").split()

    def is_empty(self) -> bool:
        """Whether no job is queued or running."""
        return not self.run("squeue", "-h").strip()

    @staticmethod
    def wait(what: str, done, seconds: float) -> None:
        """Waits until `done()`."""
        end = time.monotonic() + seconds
        while not done():
            if time.monotonic() > end:
                raise RuntimeError(f"waited {seconds:.0f} s: {what}")
            time.sleep(0.2)

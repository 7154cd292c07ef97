"""A cluster of one machine: munged, slurmctld and slurmd, with all they need in one folder.

Any user may start it. Nothing is written elsewhere, and another SLURM on the machine is left alone.
"""

import getpass
import os
import secrets
import shutil
import socket
import subprocess
import time
from contextlib import ExitStack

DAEMONS = {"munged": "munge", "slurmctld": "slurm-wlm", "slurmd": "slurm-wlm"}
COMMANDS = ("sacct", "sbatch", "scancel", "scontrol", "sinfo", "squeue", "srun")
CONFIGURATION = """\
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
MailProg=/bin/true
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
ReturnToService=2
KillWait=2
NodeName=localhost NodeAddr=127.0.0.1 CPUs=16 RealMemory=64000
PartitionName=short Nodes=localhost Default=YES MaxTime=60
"""
# Where daemons lie, which a user's path may leave out.
SYSTEM = ["/usr/sbin", "/sbin"]
PATIENCE = 30  # seconds


def missing():
    """Why there can be no cluster here, in one line; nothing where there can."""
    path = os.pathsep.join([os.environ["PATH"], *SYSTEM])
    lacking = [name for name in (*DAEMONS, *COMMANDS) if not shutil.which(name, path=path)]
    if not lacking:
        return ""
    packages = sorted({DAEMONS.get(name, "slurm-wlm") for name in lacking})
    return f"no {', '.join(lacking)}; Debian's packages are {' '.join(packages)}"


def free_ports(count):
    """Ports that nobody listens on."""
    with ExitStack() as stack:
        sockets = [stack.enter_context(socket.socket()) for _ in range(count)]
        for each in sockets:
            each.bind(("127.0.0.1", 0))
        return [each.getsockname()[1] for each in sockets]


class Cluster:
    """A context in which the commands of SLURM, called with `environment`, find this cluster."""

    def __init__(self, folder):
        self.folder = folder
        self.daemons = []
        # The variable SLURM_CONF does not reach the steps of a job, so the commands set it.
        path = os.pathsep.join([f"{folder}/bin", os.environ["PATH"], *SYSTEM])
        self.environment = {**os.environ, "PATH": path}

    def __enter__(self):
        try:
            self.configure()
            key, socket_file = self.folder / "munge.key", self.folder / "munge.socket"
            files = [f"--key-file={key}", f"--socket={socket_file}"]
            files += [
                f"--{name}-file={self.folder}/munge.{name}" for name in ("pid", "log", "seed")
            ]
            self.start("munged", "--foreground", "--force", *files)
            self.wait("munge", socket_file.exists)
            configuration = self.folder / "slurm.conf"
            self.start("slurmctld", "-D", "-c", "-f", configuration)
            self.start("slurmd", "-D", "-N", "localhost", "-f", configuration)
            self.wait("a node that is idle", lambda: self.ask("sinfo", "-h", "-o", "%t") == "idle")
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        if len(self.daemons) > 1:
            self.ask("scancel", "--user", getpass.getuser())
            deadline = time.monotonic() + PATIENCE
            while self.ask("squeue", "-h") and time.monotonic() < deadline:
                time.sleep(0.2)
        for daemon in reversed(self.daemons):
            daemon.terminate()
        for daemon in reversed(self.daemons):
            try:
                daemon.wait(10)
            except subprocess.TimeoutExpired:
                daemon.kill()
                daemon.wait()

    def configure(self):
        """The files that daemons and commands read."""
        for name in ("state", "spool", "bin"):
            (self.folder / name).mkdir(mode=0o755)
        key = self.folder / "munge.key"
        key.touch(mode=0o600)
        key.write_bytes(secrets.token_bytes(128))
        text = CONFIGURATION.format(
            host=socket.gethostname().split(".")[0],
            ports=free_ports(2),
            user=getpass.getuser(),
            folder=self.folder,
        )
        configuration = self.folder / "slurm.conf"
        configuration.write_text(text)
        # Not to look for control groups: a container may have none, and none are used.
        (self.folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
        for name in COMMANDS:
            command = self.folder / "bin" / name
            command.write_text(
                f'#!/bin/sh\nSLURM_CONF={configuration} exec {shutil.which(name)} "$@"\n'
            )
            command.chmod(0o755)

    def start(self, name, *arguments):
        """Start a daemon that ends with this process, even where that is killed."""
        with (self.folder / f"{name}.log").open("w") as log:
            self.daemons.append(
                subprocess.Popen(
                    ["setpriv", "--pdeathsig", "TERM", name, *map(str, arguments)],
                    env=self.environment,
                    stdin=subprocess.DEVNULL,
                    stdout=log,
                    stderr=log,
                    start_new_session=True,  # what stops the test at a terminal is for it to tell
                )
            )

    def wait(self, what, ready):
        """Wait until something is there; what the daemons said where it does not come."""
        deadline = time.monotonic() + PATIENCE
        while not ready():
            if time.monotonic() > deadline or any(d.poll() is not None for d in self.daemons):
                said = "\n".join(log.read_text() for log in self.folder.glob("*.log"))
                raise RuntimeError(f"{what} does not come; its daemons say:\n{said}")
            time.sleep(0.1)

    def ask(self, *command):
        """What a command of SLURM prints."""
        run = subprocess.run(
            command,
            env=self.environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        return run.stdout.strip()

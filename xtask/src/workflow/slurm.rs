//! Slurm on this machine: one node of its own configuration, with keys and folders of its own.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use crate::shell::Outcome;

/// The cluster; it ends with this.
pub(crate) struct Slurm {
    folder: PathBuf,
}

/// Where programs of Slurm look for a configuration: a job is not told of another place.
const CONFIGURATION: &str = "/etc/slurm/slurm.conf";

impl Slurm {
    /// Installs Debian's `slurm-wlm` where it is missing, and starts it; says why where that can't be done.
    pub(crate) fn started(folder: &Path) -> Option<Self> {
        if Path::new(CONFIGURATION).exists() {
            println!("── Slurm skipped: {CONFIGURATION} is there already, and it is not ours to change");
            return None;
        }
        let installed = || Command::new("slurmctld").arg("-V").output().is_ok_and(|output| output.status.success());
        if !installed() {
            println!("── installing slurm-wlm");
            let _ = Command::new("apt-get").args(["update", "-qq"]).output();
            let mut install = Command::new("apt-get");
            let _ =
                install.args(["install", "-y", "-qq", "slurm-wlm"]).env("DEBIAN_FRONTEND", "noninteractive").output();
        }
        if !installed() {
            println!(
                "── Slurm skipped: slurm-wlm can't be installed here; it needs Debian, its packages, and their administrator"
            );
            return None;
        }
        let slurm = Self { folder: folder.to_owned() };
        match slurm.start() {
            Ok(()) => Some(slurm),
            Err(message) => {
                println!("── Slurm skipped: it does not start here: {message}");
                None
            }
        }
    }

    /// What Snakemake's plugin has to be told of a cluster without accounting.
    pub(crate) fn options() -> [String; 9] {
        [
            "--slurm-status-command",
            "squeue",
            "--slurm-no-account",
            "--slurm-init-seconds-before-status-checks",
            "2",
            "--seconds-between-status-checks",
            "2",
            "--latency-wait",
            "10",
        ]
        .map(str::to_owned)
    }

    /// Kills the controller and starts it again.
    pub(crate) fn restart_controller(&self) -> Outcome {
        self.kill("slurmctld.pid", "-9");
        std::thread::sleep(Duration::from_secs(2));
        run(&mut Command::new("slurmctld"))
    }

    fn start(&self) -> Outcome {
        let fail = |error: std::io::Error| format!("{}: {error}", self.folder.display());
        for folder in ["state", "spool", "log", "munge"] {
            fs::create_dir_all(self.folder.join(folder)).map_err(fail)?;
        }
        let munge = self.folder.join("munge");
        keep_private(&munge, 0o700).map_err(fail)?;
        let mut key = [0; 128];
        File::open("/dev/urandom").and_then(|mut source| source.read_exact(&mut key)).map_err(fail)?;
        let file = munge.join("key");
        fs::write(&file, key).map_err(fail)?;
        keep_private(&file, 0o400).map_err(fail)?;
        let option = |name: &str, file: &str| format!("--{name}={}", munge.join(file).display());
        let options = [
            ("key-file", "key"),
            ("socket", "socket"),
            ("pid-file", "pid"),
            ("log-file", "log"),
            ("seed-file", "seed"),
        ];
        run(Command::new("munged").args(options.map(|(name, file)| option(name, file))).arg("--force"))?;
        let host = fs::read_to_string("/proc/sys/kernel/hostname").map_err(fail)?;
        let text = configuration(host.trim(), &self.folder);
        fs::write(CONFIGURATION, text).map_err(|error| format!("{CONFIGURATION}: {error}"))?;
        run(&mut Command::new("slurmctld"))?;
        run(&mut Command::new("slurmd"))?;
        // The node answers when it has told the controller of itself.
        run(Command::new("srun").args(["--time=1", "true"]))
    }

    fn kill(&self, file: &str, signal: &str) {
        if let Ok(process) = fs::read_to_string(self.folder.join(file)) {
            // One that is gone already is no matter.
            let _ = Command::new("kill").args([signal, process.trim()]).output();
        }
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        for file in ["slurmctld.pid", "slurmd.pid", "munge/pid"] {
            self.kill(file, "-15");
        }
        let _ = fs::remove_file(CONFIGURATION);
    }
}

fn configuration(host: &str, folder: &Path) -> String {
    let at = |name: &str| folder.join(name).display().to_string();
    // Jobs wait more than they compute: for files that appear, for the controller.
    let cpus = 3 * std::thread::available_parallelism().map_or(1, usize::from);
    format!(
        "ClusterName=one\nSlurmctldHost={host}(127.0.0.1)\nSlurmUser=root\nSlurmdUser=root\nAuthType=auth/munge\nAuthInfo=socket={}\n\
         StateSaveLocation={}\nSlurmdSpoolDir={}\nSlurmctldPidFile={}\nSlurmdPidFile={}\nSlurmctldLogFile={}\nSlurmdLogFile={}\n\
         SlurmctldPort=16817\nSlurmdPort=16818\nProctrackType=proctrack/linuxproc\nTaskPlugin=task/none\nSelectType=select/cons_tres\n\
         SelectTypeParameters=CR_Core\nJobAcctGatherType=jobacct_gather/none\nAccountingStorageType=accounting_storage/none\n\
         SlurmdParameters=config_overrides\nReturnToService=2\nMpiDefault=none\nMinJobAge=3600\n\
         NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=16000 State=UNKNOWN\n\
         PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP\n",
        at("munge/socket"),
        at("state"),
        at("spool"),
        at("slurmctld.pid"),
        at("slurmd.pid"),
        at("log/slurmctld.log"),
        at("log/slurmd.log"),
    )
}

/// A key that others can read is taken for none.
#[cfg(unix)]
fn keep_private(path: &Path, mode: u32) -> std::io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(path, fs::Permissions::from_mode(mode))
}

#[cfg(not(unix))]
fn keep_private(_: &Path, _: u32) -> std::io::Result<()> {
    Ok(())
}

fn run(command: &mut Command) -> Outcome {
    let line = format!("{command:?}");
    let output = command.output().map_err(|error| format!("{line}: {error}"))?;
    if output.status.success() { Ok(()) } else { Err(format!("{line}: {}", String::from_utf8_lossy(&output.stderr))) }
}

//! Finds and starts QEMU.

use crate::Error;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

/// QEMU's board with an STM32F405, from QEMU 8 on.
pub(crate) const OLIMEX: &str = "olimex-stm32-h405";
/// Machine of older QEMU versions; its USART does not send by interrupt.
pub(crate) const NETDUINO: &str = "netduinoplus2";

/// Duration of an instruction as a power of two \[ns\]: 8 ns by default.
pub(crate) const SHIFT: u32 = 3;

/// Returns the arguments that advance time by 2^`shift` ns per instruction and stop time while the processor waits for
/// the host.
pub(crate) fn count_instructions(shift: u32) -> [String; 2] {
    ["-icount".into(), format!("shift={shift},sleep=off")]
}

/// Core clock of this processor \[MHz\].
pub(crate) const CORE_MHZ: u32 = 168;

/// Converts core cycles, counted by SysTick, to instructions of 2^`shift` ns.
pub(crate) fn instructions(cycles: u32, shift: u32) -> u32 {
    // The result is rounded, since an instruction of 8 ns takes 1.344 cycles.
    let cycles_per_thousand = u64::from(CORE_MHZ << shift);
    ((u64::from(cycles) * 1000 + cycles_per_thousand / 2) / cycles_per_thousand) as u32
}

/// A QEMU process with an image, halted or running. Dropping it ends the process and removes its folder.
#[derive(Debug)]
pub(crate) struct Qemu {
    child: Child,
    folder: PathBuf,
}

impl Qemu {
    /// Creates an empty folder shared by host and emulator.
    pub(crate) fn folder() -> Result<PathBuf, Error> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        // Tests run several emulators at once, within a process and in several processes.
        let name = format!("pil-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder)?;
        Ok(folder)
    }

    /// Starts `elf` in `folder` on the first of `machines` that this QEMU has, with additional arguments.
    pub(crate) fn start(
        elf: &Path,
        folder: PathBuf,
        machines: &[&str],
        arguments: &[impl AsRef<OsStr>],
    ) -> Result<Self, Error> {
        if !elf.is_file() {
            return Err(Error::NoImage(elf.to_owned()));
        }
        let elf = elf.canonicalize()?;
        let child = Command::new(program())
            .args(["-M", machine(machines)?, "-nographic", "-monitor", "none"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .args(arguments)
            .arg("-kernel")
            .arg(elf)
            .current_dir(&folder)
            .stdin(Stdio::null())
            .spawn()?;
        Ok(Qemu { child, folder })
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Ends QEMU.
    pub(crate) fn kill(&mut self) {
        // QEMU may already have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Returns [`Error::Exited`] if QEMU has ended.
    pub(crate) fn check(&mut self) -> Result<(), Error> {
        match self.child.try_wait()? {
            Some(status) => Err(Error::Exited(status.to_string())),
            None => Ok(()),
        }
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        self.kill();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

/// Returns the program `QEMU_SYSTEM_ARM` or, if that is not set, `qemu-system-arm` in the search path.
fn program() -> std::ffi::OsString {
    std::env::var_os("QEMU_SYSTEM_ARM").unwrap_or_else(|| "qemu-system-arm".into())
}

/// Returns the first of `machines` that this QEMU has.
fn machine<'a>(machines: &[&'a str]) -> Result<&'a str, Error> {
    let help = Command::new(program()).args(["-machine", "help"]).output().map_err(|_| Error::NoQemu)?;
    let help = String::from_utf8_lossy(&help.stdout);
    machines.iter().copied().find(|machine| help.contains(machine)).ok_or(Error::NoMachine)
}

//! A shared library of the sources, by the compiler of the platform.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU64, Ordering};
use std::{env, fs, io, mem, process};

use dynamics_view::FileError;

use crate::error::FmuError;
use crate::fmu::FmuFile;

/// A folder that is removed in the end.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Result<Self, FmuError> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = env::temp_dir().join(format!("dynamics-fmu-{}-{number}", process::id()));
            match fs::create_dir(&path) {
                Ok(()) => return Ok(Self(path)),
                // Somebody else's, or kept by a process of the same number: the next one.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(source) => return Err(FileError { path, action: "create the folder", source }.into()),
            }
        }
    }

    /// Leaves the folder where it is.
    fn keep(mut self) -> PathBuf {
        mem::take(&mut self.0)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A kept folder has no path any more.
        if !self.0.as_os_str().is_empty() {
            let _ = fs::remove_dir_all(&self.0);
        }
    }
}

/// The name of the platform in the standard, and the extension of its shared libraries.
fn platform() -> Result<(String, &'static str), FmuError> {
    let unknown = || FmuError::Platform { platform: format!("{}-{}", env::consts::ARCH, env::consts::OS) };
    let architecture = match env::consts::ARCH {
        known @ ("x86_64" | "x86" | "aarch64" | "riscv32" | "riscv64") => known,
        "arm" => "aarch32",
        "powerpc" => "ppc32",
        "powerpc64" => "ppc64",
        _ => return Err(unknown()),
    };
    let (system, extension) = match env::consts::OS {
        "linux" => ("linux", "so"),
        "macos" => ("darwin", "dylib"),
        "windows" => ("windows", "dll"),
        _ => return Err(unknown()),
    };
    Ok((format!("{architecture}-{system}"), extension))
}

/// The program and the arguments in `CC`, as in `ccache gcc`; a path with spaces is a program.
fn words(compiler: &str) -> (&str, Vec<&str>) {
    let mut words = compiler.split_whitespace();
    match words.next() {
        Some(first) if !Path::new(compiler).is_file() => (first, words.collect()),
        _ => (compiler, Vec::new()),
    }
}

/// The library, as a file of the unit.
pub(crate) fn library(name: &str, sources: &[(String, String)]) -> Result<FmuFile, FmuError> {
    let (platform, extension) = platform()?;
    let folder = Folder::new()?;
    let failed = |path: &PathBuf, action| {
        let path = path.clone();
        move |source| FileError { path, action, source }
    };
    for (file, text) in sources {
        let path = folder.0.join(file);
        fs::write(&path, text).map_err(failed(&path, "write"))?;
    }
    let compiler = env::var("CC").unwrap_or_else(|_| "cc".to_owned());
    let out = format!("{name}.{extension}");
    let (program, arguments) = words(&compiler);
    let mut command = Command::new(program);
    command.args(arguments).current_dir(&folder.0).args([
        "-std=c99",
        "-O2",
        "-ffp-contract=off",
        "-shared",
        "-o",
        &out,
    ]);
    if extension != "dll" {
        command.args(["-fPIC", "-fvisibility=hidden"]);
    }
    let files = sources.iter().map(|(file, _)| file).filter(|file| file.ends_with(".c"));
    let output = command.args(files).arg("-lm").output();
    let output = output.map_err(|source| FmuError::NoCompiler { compiler: compiler.clone(), source })?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(FmuError::Compiler { compiler, folder: folder.keep(), said });
    }
    let path = folder.0.join(&out);
    let bytes = fs::read(&path).map_err(failed(&path, "read"))?;
    Ok(FmuFile { name: format!("binaries/{platform}/{out}"), bytes })
}

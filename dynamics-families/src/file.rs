//! Frames in a folder of NumPy files, written as they come.
//!
//! | file | shape | contains |
//! |---|---|---|
//! | `t.npy` | (frames,) | times |
//! | `q.npy` | (frames, coordinates) | coordinates, one field after the other |
//! | `u.npy` | (frames, coordinates) | velocities, likewise |
//! | `energies.npy` | (frames, 2) | T and V |
//!
//! Each is an array of little-endian `float64` in NumPy's format 1.0, read by
//! `numpy.load(path, mmap_mode="r")`. The header has a fixed length and is written again with the number of
//! frames whenever data reach the file, so that a run that breaks off leaves what it had. Source: NumPy
//! Enhancement Proposal 1.

use std::fs;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use dynamics_view::FileError;

use crate::model::EnergyParts;

/// Bytes of a header: a multiple of 64, long enough for all shapes.
const HEADER: usize = 128;
/// Data are written when so many bytes have come.
const BUFFER: usize = 1 << 20;

/// An array whose first axis grows.
struct Array {
    path: PathBuf,
    file: fs::File,
    /// Numbers of a frame; none where a frame is one number without an axis.
    columns: Option<usize>,
    frames: u64,
    buffer: Vec<u8>,
}

impl Array {
    fn create(folder: &Path, name: &str, columns: Option<usize>) -> Result<Self, FileError> {
        let path = folder.join(name);
        let file = fs::File::create(&path);
        let file = file.map_err(|source| FileError { path: path.clone(), action: "create", source })?;
        let mut array = Self { path, file, columns, frames: 0, buffer: Vec::with_capacity(BUFFER) };
        array.flush()?;
        Ok(array)
    }

    fn header(&self) -> [u8; HEADER] {
        let shape = match self.columns {
            Some(columns) => format!("({}, {columns})", self.frames),
            None => format!("({},)", self.frames),
        };
        let text = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}");
        let mut header = [b' '; HEADER];
        header[..8].copy_from_slice(b"\x93NUMPY\x01\x00");
        header[8..10].copy_from_slice(&((HEADER - 10) as u16).to_le_bytes());
        header[10..10 + text.len()].copy_from_slice(text.as_bytes());
        header[HEADER - 1] = b'\n';
        header
    }

    fn push(&mut self, values: &[f64]) -> Result<(), FileError> {
        for values in values.chunks(BUFFER / 8) {
            values.iter().for_each(|value| self.buffer.extend_from_slice(&value.to_le_bytes()));
            if self.buffer.len() >= BUFFER {
                self.write_buffer().map_err(|source| self.failed(source))?;
            }
        }
        self.frames += 1;
        Ok(())
    }

    fn write_buffer(&mut self) -> io::Result<()> {
        self.file.seek(SeekFrom::End(0))?;
        self.file.write_all(&self.buffer)?;
        self.buffer.clear();
        Ok(())
    }

    fn flush(&mut self) -> Result<(), FileError> {
        let header = self.header();
        let written = (|| {
            self.file.seek(SeekFrom::Start(0))?;
            self.file.write_all(&header)?;
            self.write_buffer()?;
            self.file.flush()
        })();
        written.map_err(|source| self.failed(source))
    }

    fn failed(&self, source: io::Error) -> FileError {
        FileError { path: self.path.clone(), action: "write", source }
    }
}

/// The files of a run.
pub(crate) struct FrameFile {
    arrays: [Array; 4],
    unwritten: usize,
}

impl FrameFile {
    /// Makes the folder and its files; what they contained is lost.
    pub(crate) fn create(folder: &Path, coordinates: usize) -> Result<Self, FileError> {
        fs::create_dir_all(folder).map_err(|source| FileError {
            path: folder.to_path_buf(),
            action: "create the folder",
            source,
        })?;
        let array = |name, columns| Array::create(folder, name, columns);
        let arrays = [
            array("t.npy", None)?,
            array("q.npy", Some(coordinates))?,
            array("u.npy", Some(coordinates))?,
            array("energies.npy", Some(2))?,
        ];
        Ok(Self { arrays, unwritten: 0 })
    }

    /// Appends a frame.
    pub(crate) fn push(
        &mut self,
        t: f64,
        q: &[f64],
        u: &[f64],
        energies: EnergyParts,
    ) -> Result<(), FileError> {
        let energies = [energies.kinetic, energies.potential];
        let parts: [&[f64]; 4] = [&[t], q, u, &energies];
        for (array, values) in self.arrays.iter_mut().zip(parts) {
            array.push(values)?;
        }
        self.unwritten += 8 * (q.len() + u.len() + 3);
        if self.unwritten >= BUFFER { self.flush() } else { Ok(()) }
    }

    /// Writes all that has come, and the number of frames.
    pub(crate) fn flush(&mut self) -> Result<(), FileError> {
        self.unwritten = 0;
        self.arrays.iter_mut().try_for_each(Array::flush)
    }
}

impl Drop for FrameFile {
    fn drop(&mut self) {
        // A run that panics leaves what it had. There is nobody to tell of an error.
        let _ = self.flush();
    }
}

//! The file itself: a ZIP archive, as APPNOTE.TXT 6.3 describes it, of deflated files. There is no clock in
//! it: the same model gives the same bytes.

use miniz_oxide::deflate::compress_to_vec;

use crate::error::FmuError;
use crate::fmu::FmuFile;

/// Level of compression: beyond it the texts here become hardly smaller.
const LEVEL: u8 = 6;
/// Version 2.0 of the format: folders and deflated files.
const VERSION: u16 = 20;
/// Names are in UTF-8.
const FLAGS: u16 = 1 << 11;
const DEFLATED: u16 = 8;
/// 1 January 1980, midnight: the first time that the format knows.
const TIME: u16 = 0;
const DATE: u16 = 0x21;
/// Made on Unix, where the attributes are those of a plain file, readable by all.
const MADE_BY: u16 = 3 << 8 | VERSION;
const ATTRIBUTES: u32 = 0o100_644 << 16;

/// The check sum of Ethernet and ZIP: the reflected polynomial 0xEDB88320.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), step))
}

/// What stands both before a file and in the list of all.
fn common(file: &FmuFile, deflated: &[u8]) -> Result<Vec<u8>, FmuError> {
    let size =
        |bytes: &[u8]| u32::try_from(bytes.len()).map_err(|_| FmuError::TooLarge { name: file.name.clone() });
    let name = u16::try_from(file.name.len()).map_err(|_| FmuError::TooLarge { name: file.name.clone() })?;
    let mut out = Vec::new();
    for word in [VERSION, FLAGS, DEFLATED, TIME, DATE] {
        out.extend(word.to_le_bytes());
    }
    for word in [crc32(&file.bytes), size(deflated)?, size(&file.bytes)?] {
        out.extend(word.to_le_bytes());
    }
    for word in [name, 0] {
        out.extend(word.to_le_bytes());
    }
    Ok(out)
}

/// The archive of files.
pub(crate) fn archive(files: &[FmuFile]) -> Result<Vec<u8>, FmuError> {
    let (mut out, mut list) = (Vec::new(), Vec::new());
    for file in files {
        let offset = u32::try_from(out.len()).map_err(|_| FmuError::TooLarge { name: file.name.clone() })?;
        let deflated = compress_to_vec(&file.bytes, LEVEL);
        let common = common(file, &deflated)?;
        out.extend(0x0403_4b50_u32.to_le_bytes());
        out.extend(&common);
        out.extend(file.name.as_bytes());
        out.extend(deflated);
        list.extend(0x0201_4b50_u32.to_le_bytes());
        list.extend(MADE_BY.to_le_bytes());
        list.extend(&common);
        // No comment, first disk, a binary file.
        list.extend([0; 6]);
        list.extend(ATTRIBUTES.to_le_bytes());
        list.extend(offset.to_le_bytes());
        list.extend(file.name.as_bytes());
    }
    let too_large = |_| FmuError::TooLarge { name: "the list of files".to_owned() };
    let count = u16::try_from(files.len()).unwrap_or(u16::MAX);
    let (begin, length) = (u32::try_from(out.len()), u32::try_from(list.len()));
    let (begin, length) = (begin.map_err(too_large)?, length.map_err(too_large)?);
    out.extend(list);
    out.extend(0x0605_4b50_u32.to_le_bytes());
    out.extend([0; 4]);
    out.extend(count.to_le_bytes());
    out.extend(count.to_le_bytes());
    out.extend(length.to_le_bytes());
    out.extend(begin.to_le_bytes());
    out.extend([0; 2]);
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::crc32;

    #[test]
    fn the_check_sum_is_that_of_the_standard() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
        assert_eq!(crc32(b""), 0);
    }
}

//! A reader over the bytes of a file that never goes beyond their end: little-endian numbers, and errors that say where.

use crate::error::{Code, Error, Result};

/// A position in a slice of bytes, and the numbers from there on.
#[derive(Clone, Debug)]
pub struct Bytes<'a> {
    data: &'a [u8],
    position: usize,
}

/// A method for each kind of number.
macro_rules! numbers {
    ($($name:ident: $kind:ty,)*) => {
        $(
            #[doc = concat!("The next little-endian `", stringify!($kind), "`; [`Code::Corrupt`] at the end.")]
            pub fn $name(&mut self) -> Result<$kind> {
                self.array().map(<$kind>::from_le_bytes)
            }
        )*
    };
}

impl<'a> Bytes<'a> {
    /// A reader at the start of `data`, which positions count from.
    pub fn new(data: &'a [u8]) -> Bytes<'a> {
        Bytes { data, position: 0 }
    }

    numbers! {
        u8: u8,
        u16: u16,
        u32: u32,
        u64: u64,
        i8: i8,
        i32: i32,
        i64: i64,
        f32: f32,
        f64: f64,
        f16: half::f16,
    }

    /// Bytes from the start of the data to here.
    pub fn position(&self) -> usize {
        self.position
    }

    /// Bytes from here to the end.
    pub fn remaining(&self) -> usize {
        self.data.len() - self.position
    }

    /// Goes to byte `position`; [`Code::Corrupt`] where that lies beyond the end (the end itself is allowed).
    pub fn seek(&mut self, position: u64) -> Result<()> {
        match usize::try_from(position) {
            Ok(position) if position <= self.data.len() => {
                self.position = position;
                Ok(())
            }
            _ => Err(self.corrupt(format!("it points to byte {position} of {}", self.data.len()))),
        }
    }

    /// The next `count` bytes; [`Code::Corrupt`] where there are fewer.
    pub fn take(&mut self, count: usize) -> Result<&'a [u8]> {
        let rest = &self.data[self.position..];
        let Some(taken) = rest.get(..count) else {
            return Err(self.corrupt(format!("{count} bytes are needed, but only {} are left", rest.len())));
        };
        self.position += count;
        Ok(taken)
    }

    /// The next `N` bytes; [`Code::Corrupt`] where there are fewer.
    pub fn array<const N: usize>(&mut self) -> Result<[u8; N]> {
        Ok(*self.take(N)?.first_chunk().expect("take gives as many bytes as were asked for"))
    }

    /// An error at this place: `why` says what is wrong there, as a part of a sentence.
    pub fn corrupt(&self, why: impl std::fmt::Display) -> Error {
        Error::new(Code::Corrupt, "The file is damaged or cut short.")
            .why(format!("At byte {}: {why}.", self.position))
            .hint("Copy or export the file again.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_little_endian_and_move_on_by_their_size() {
        let mut data = vec![0xfe, 0x01, 0x02, 0x03, 0x04, 0x05, 0x06];
        data.extend(0x0102_0304_0506_0708_u64.to_le_bytes());
        data.extend((-3_i8).to_le_bytes());
        data.extend((-70_000_i32).to_le_bytes());
        data.extend((-5_000_000_000_i64).to_le_bytes());
        data.extend(1.5_f32.to_le_bytes());
        data.extend((-0.1_f64).to_le_bytes());
        data.extend(half::f16::from_f32(0.25).to_le_bytes());
        let mut bytes = Bytes::new(&data);
        assert_eq!(bytes.u8().unwrap(), 0xfe);
        assert_eq!(bytes.u16().unwrap(), 0x0201);
        assert_eq!(bytes.u32().unwrap(), 0x0605_0403);
        assert_eq!(bytes.u64().unwrap(), 0x0102_0304_0506_0708);
        assert_eq!(bytes.i8().unwrap(), -3);
        assert_eq!(bytes.i32().unwrap(), -70_000);
        assert_eq!(bytes.i64().unwrap(), -5_000_000_000);
        assert_eq!(bytes.f32().unwrap(), 1.5);
        assert_eq!(bytes.f64().unwrap(), -0.1);
        assert_eq!(bytes.f16().unwrap().to_f32(), 0.25);
        assert_eq!((bytes.position(), bytes.remaining()), (data.len(), 0));
    }

    #[test]
    fn the_end_is_an_error_that_names_the_place_and_moves_nothing() {
        let mut bytes = Bytes::new(&[1, 2, 3, 4, 5]);
        bytes.take(3).unwrap();
        let error = bytes.u32().unwrap_err();
        assert_eq!(error.code, Code::Corrupt);
        assert_eq!(error.why, "At byte 3: 4 bytes are needed, but only 2 are left.");
        assert_eq!(bytes.take(usize::MAX).unwrap_err().code, Code::Corrupt);
        assert_eq!(bytes.take(2).unwrap(), [4, 5]);
        assert_eq!(bytes.take(0).unwrap(), [0; 0]);
    }

    #[test]
    fn seek_reaches_the_end_but_not_beyond() {
        let mut bytes = Bytes::new(&[1, 2, 3]);
        bytes.seek(3).unwrap();
        assert_eq!(bytes.remaining(), 0);
        bytes.seek(1).unwrap();
        assert_eq!(bytes.seek(4).unwrap_err().code, Code::Corrupt);
        assert_eq!(bytes.seek(u64::MAX).unwrap_err().code, Code::Corrupt);
        assert_eq!(bytes.u8().unwrap(), 2);
    }
}

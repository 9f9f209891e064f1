//! JSON for people: one object a line or a field a line, arrays of numbers in one line.

use serde::Serialize;
use serde_json::ser::Formatter;
use std::io::{self, Write};

/// `value` as JSON text that ends with a line feed. Fails only if `value` cannot be expressed in JSON (a map with keys
/// that are no strings).
pub fn to_text<T: Serialize>(value: &T) -> Result<Vec<u8>, serde_json::Error> {
    let mut text = Vec::new();
    value.serialize(&mut serde_json::Serializer::with_formatter(&mut text, OneFieldALine { depth: 0 }))?;
    text.push(b'\n');
    Ok(text)
}

/// Objects begin on a new line, each field has its own; arrays of numbers stay in one line.
struct OneFieldALine {
    depth: usize,
}

impl OneFieldALine {
    fn new_line<W: Write + ?Sized>(&self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b"\n")?;
        (0..self.depth).try_for_each(|_| writer.write_all(b"  "))
    }
}

impl Formatter for OneFieldALine {
    fn begin_object<W: Write + ?Sized>(&mut self, writer: &mut W) -> io::Result<()> {
        self.depth += 1;
        writer.write_all(b"{")
    }

    fn end_object<W: Write + ?Sized>(&mut self, writer: &mut W) -> io::Result<()> {
        self.depth -= 1;
        self.new_line(writer)?;
        writer.write_all(b"}")
    }

    fn begin_object_key<W: Write + ?Sized>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        if !first {
            writer.write_all(b",")?;
        }
        self.new_line(writer)
    }

    fn begin_object_value<W: Write + ?Sized>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }

    fn begin_array_value<W: Write + ?Sized>(&mut self, writer: &mut W, first: bool) -> io::Result<()> {
        if first { Ok(()) } else { writer.write_all(b", ") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stay_in_a_line_and_fields_have_their_own() {
        let value = serde_json::json!({ "A": [[1.0, 0.0], [0.0, 1.0]], "list": [{ "id": 1 }, { "id": 2 }] });
        let text = String::from_utf8(to_text(&value).unwrap()).unwrap();
        assert_eq!(
            text,
            "{\n  \"A\": [[1.0, 0.0], [0.0, 1.0]],\n  \"list\": [{\n    \"id\": 1\n  }, {\n    \"id\": 2\n  }]\n}\n"
        );
        assert_eq!(serde_json::from_str::<serde_json::Value>(&text).unwrap(), value);
    }

    #[test]
    fn every_finite_number_survives() {
        for value in [0.1 + 0.2, f64::MIN_POSITIVE, -1.0 / 3.0, 1e300, 5e-324] {
            let text = to_text(&vec![value]).unwrap();
            let back: Vec<f64> = serde_json::from_slice(&text).unwrap();
            assert_eq!(back[0].to_bits(), value.to_bits());
        }
    }
}

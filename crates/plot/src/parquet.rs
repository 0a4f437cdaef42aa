//! Reads Parquet files without nested columns.

use crate::table::LogTable;
use ::parquet::errors::ParquetError;
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::record::Field;
use bytes::Bytes;

/// A column while it is read; it becomes a column of words if any row has a word.
#[derive(Default)]
struct ParsedColumn {
    numbers: Vec<f64>,
    words: Vec<String>,
    has_words: bool,
}

/// Reads the file's only table.
pub(crate) fn read(bytes: Vec<u8>) -> Result<Vec<LogTable>, String> {
    rows(bytes).map(|table| vec![table]).map_err(|error| {
        format!(
            "the file cannot be read as Parquet ({error}); write it uncompressed or with Snappy, without nested columns"
        )
    })
}

fn rows(bytes: Vec<u8>) -> Result<LogTable, ParquetError> {
    let reader = SerializedFileReader::new(Bytes::from(bytes))?;
    let schema = reader.metadata().file_metadata().schema_descr();
    let names: Vec<String> = schema.columns().iter().map(|column| column.path().string()).collect();
    let mut columns: Vec<ParsedColumn> = names.iter().map(|_| ParsedColumn::default()).collect();
    for row in reader.get_row_iter(None)? {
        for (column, (_, field)) in columns.iter_mut().zip(row?.get_column_iter()) {
            let (number, word) = value(field);
            column.numbers.push(number);
            column.has_words |= word.is_some();
            column.words.push(word.unwrap_or_default());
        }
    }
    let mut table = LogTable::default();
    for (name, column) in names.into_iter().zip(columns) {
        match column.has_words {
            true => table.words.push((name, column.words)),
            false => table.numbers.push((name, column.numbers)),
        }
    }
    Ok(table)
}

/// Returns a field as a number or as a word; NaN if it is neither.
fn value(field: &Field) -> (f64, Option<String>) {
    let number = match field {
        Field::Bool(value) => f64::from(u8::from(*value)),
        Field::Byte(value) => f64::from(*value),
        Field::Short(value) => f64::from(*value),
        Field::Int(value) => f64::from(*value),
        Field::Long(value) => *value as f64,
        Field::UByte(value) => f64::from(*value),
        Field::UShort(value) => f64::from(*value),
        Field::UInt(value) => f64::from(*value),
        Field::ULong(value) => *value as f64,
        Field::Float(value) => f64::from(*value),
        Field::Double(value) => *value,
        Field::Str(word) => return (f64::NAN, Some(word.clone())),
        _ => f64::NAN,
    };
    (number, None)
}

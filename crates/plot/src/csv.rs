//! Reads CSV files with a header.

use crate::table::LogTable;
use afbc_files::read::DelimitedFormat;

/// Reads the file's only table. A column without any number becomes a column of words.
pub(crate) fn read(bytes: &[u8]) -> Result<Vec<LogTable>, String> {
    let form = DelimitedFormat::of(bytes);
    let mut reader = csv::ReaderBuilder::new().delimiter(form.separator).from_reader(bytes);
    let bad = |error: csv::Error| match error.position() {
        Some(place) => {
            format!(
                "line {}: this is not a CSV file ({error}); give CSV with a header, Parquet, ULog or MCAP",
                place.line()
            )
        }
        None => format!("this is not a CSV file ({error}); give CSV with a header, Parquet, ULog or MCAP"),
    };
    let heads: Vec<String> = reader.headers().map_err(bad)?.iter().map(|head| head.trim().to_owned()).collect();
    let mut fields: Vec<Vec<String>> = vec![Vec::new(); heads.len()];
    for record in reader.records() {
        let record = record.map_err(bad)?;
        fields.iter_mut().zip(&record).for_each(|(column, field)| column.push(field.trim().to_owned()));
    }
    let mut table = LogTable::default();
    for (head, fields) in heads.into_iter().zip(fields) {
        let numbers: Vec<f64> = fields.iter().map(|field| form.number(field).unwrap_or(f64::NAN)).collect();
        if !fields.is_empty() && numbers.iter().all(|number| number.is_nan()) {
            table.words.push((head, fields));
        } else {
            table.numbers.push((head, numbers));
        }
    }
    match table.numbers.first() {
        Some((_, values)) if !values.is_empty() => Ok(vec![table]),
        _ => {
            Err("the file has no rows of numbers below its header; give CSV with a header, Parquet, ULog or MCAP"
                .into())
        }
    }
}

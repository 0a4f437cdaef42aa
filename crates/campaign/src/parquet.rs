//! Writes and reads rows as Parquet files.

use crate::manifest::Manifest;
use crate::row::ResultRow;
use afbc_files::seal;
use bytes::Bytes;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::column::reader::get_typed_column_reader;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::{ParquetError, Result};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{ChunkReader, FileReader, Length, RowGroupReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::PathBuf;
use std::sync::Arc;

/// Smallest and largest number of rows in a row group: a compromise between memory and file size. A shard's groups are
/// smaller, since all shards are read at once when they are merged.
const GROUP_ROWS: [usize; 2] = [1 << 10, 1 << 16];
/// Metadata key of the manifest.
const MANIFEST: &str = "campaign";
/// Names and meanings of the columns before the numbers.
const LABELS: [(&str, &str); 7] = [
    ("flight", "number of the flight, counted from 0; `sitl campaign FILE --flight NUMBER` repeats the flight"),
    ("seed", "seed of the flight's noise and weather"),
    ("contender", "the controller"),
    ("trajectory", "name of the scenario whose trajectory the flight follows"),
    ("lost", "whether the vehicle was lost"),
    ("lost_reason", "why"),
    ("trip_reason", "reason why the contender's monitor switched to the fallback law; empty if it did not"),
];

fn schema(manifest: &Manifest) -> Result<Arc<Type>> {
    let label = |(name, _): &(&str, &str)| {
        let (physical, logical) = match *name {
            "flight" | "seed" => (Physical::INT64, None),
            "lost" => (Physical::BOOLEAN, None),
            _ => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        };
        let repetition = if name.ends_with("_reason") { Repetition::OPTIONAL } else { Repetition::REQUIRED };
        Type::primitive_type_builder(name, physical).with_logical_type(logical).with_repetition(repetition).build()
    };
    let number =
        |name: &str| Type::primitive_type_builder(name, Physical::DOUBLE).with_repetition(Repetition::OPTIONAL).build();
    let labels = LABELS.iter().map(label);
    let columns = manifest.columns();
    let fields = labels.chain(columns.iter().map(|column| number(&column.name)));
    let fields = fields.map(|field| field.map(Arc::new)).collect::<Result<_>>()?;
    Type::group_type_builder("flights").with_fields(fields).build().map(Arc::new)
}

/// Writes rows in the given order.
pub(super) struct RowWriter<W: Write + Send> {
    file: SerializedFileWriter<W>,
    group_rows: usize,
    rows: Vec<ResultRow>,
}

impl<W: Write + Send> RowWriter<W> {
    /// Creates a file for the rows of `manifest`. The same rows give the same bytes.
    pub(super) fn new(out: W, manifest: &Manifest) -> Result<Self> {
        let external = |error: serde_json::Error| ParquetError::External(error.into());
        let meanings: serde_json::Map<_, _> = LABELS
            .iter()
            .map(|(name, meaning)| ((*name).into(), (*meaning).into()))
            .chain(manifest.columns().into_iter().map(|column| (column.name, column.meaning.into())))
            .collect();
        let metadata = vec![
            KeyValue::new(MANIFEST.into(), serde_json::to_string(manifest).map_err(external)?),
            KeyValue::new("columns".into(), serde_json::to_string(&meanings).map_err(external)?),
            // The checksum is last, since it has to be near the end of the file.
            KeyValue::new("checksum".into(), seal::OPEN.to_owned()),
        ];
        let properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_key_value_metadata(Some(metadata))
            .set_created_by(concat!("sitl ", env!("CARGO_PKG_VERSION")).into())
            .build();
        let file = SerializedFileWriter::new(out, schema(manifest)?, Arc::new(properties))?;
        let [least, most] = GROUP_ROWS;
        let group_rows = (most / manifest.shard.of as usize).max(least);
        Ok(RowWriter { file, group_rows, rows: Vec::new() })
    }

    pub(super) fn push(&mut self, row: ResultRow) -> Result<()> {
        self.rows.push(row);
        if self.rows.len() == self.group_rows { self.flush() } else { Ok(()) }
    }

    /// Writes the remaining rows and ends the file.
    pub(super) fn finish(mut self) -> Result<W> {
        self.flush()?;
        self.file.into_inner()
    }

    fn flush(&mut self) -> Result<()> {
        let rows = core::mem::take(&mut self.rows);
        let Some(first) = rows.first() else { return Ok(()) };
        let text = |text: &String| ByteArray::from(text.as_str());
        let mut group = self.file.next_row_group()?;
        // Flights and seeds have at most 53 bits, so none becomes negative.
        put::<Int64Type>(&mut group, rows.iter().map(|row| Some(row.flight.cast_signed())))?;
        put::<Int64Type>(&mut group, rows.iter().map(|row| Some(row.seed.cast_signed())))?;
        put::<ByteArrayType>(&mut group, rows.iter().map(|row| Some(text(&row.contender))))?;
        put::<ByteArrayType>(&mut group, rows.iter().map(|row| Some(text(&row.trajectory))))?;
        put::<BoolType>(&mut group, rows.iter().map(|row| Some(row.lost_reason.is_some())))?;
        put::<ByteArrayType>(&mut group, rows.iter().map(|row| row.lost_reason.as_ref().map(text)))?;
        put::<ByteArrayType>(&mut group, rows.iter().map(|row| row.trip_reason.as_ref().map(text)))?;
        for column in 0..first.numbers.len() {
            put::<DoubleType>(&mut group, rows.iter().map(|row| row.numbers.get(column).copied().flatten()))?;
        }
        group.close().map(drop)
    }
}

/// Writes the next column of a group.
fn put<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, impl Write + Send>,
    values: impl Iterator<Item = Option<T::T>>,
) -> Result<()> {
    let Some(mut column) = group.next_column()? else { return Err(shape()) };
    // `present` says which rows have a value; `dense` has the values.
    let (mut present, mut dense) = (Vec::new(), Vec::new());
    for value in values {
        present.push(i16::from(value.is_some()));
        dense.extend(value);
    }
    column.typed::<T>().write_batch(&dense, Some(&present), None)?;
    column.close()
}

/// A file that is open only while it is being read. Keeping many chunks open would exceed the system's limit.
pub(super) struct ReopenedFile {
    pub(super) path: PathBuf,
    pub(super) length: u64,
}

impl Length for ReopenedFile {
    fn len(&self) -> u64 {
        self.length
    }
}

impl ChunkReader for ReopenedFile {
    type T = BufReader<File>;

    fn get_read(&self, start: u64) -> Result<Self::T> {
        let mut file = File::open(&self.path)?;
        file.seek(SeekFrom::Start(start))?;
        Ok(BufReader::new(file))
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        let mut bytes = Vec::with_capacity(length);
        let read = self.get_read(start)?.take(length as u64).read_to_end(&mut bytes)?;
        if read == length { Ok(bytes.into()) } else { Err(shape()) }
    }
}

/// Reads rows in order. The file must be verified first, since the library may panic on damaged data.
pub(super) struct RowReader<R: ChunkReader + 'static> {
    file: SerializedFileReader<R>,
    manifest: Manifest,
    next_group: usize,
    rows: std::vec::IntoIter<ResultRow>,
}

impl<R: ChunkReader + 'static> RowReader<R> {
    /// Opens the rows in `source`.
    pub(super) fn new(source: R) -> Result<Self> {
        let file = SerializedFileReader::new(source)?;
        let metadata = file.metadata().file_metadata().key_value_metadata();
        let manifest = metadata.and_then(|all| all.iter().find(|pair| pair.key == MANIFEST)?.value.as_deref());
        let manifest: Manifest = manifest
            .and_then(|text| serde_json::from_str(text).ok())
            .ok_or_else(|| ParquetError::General("the file does not come from a campaign".into()))?;
        // Reading a column as another type would panic.
        if file.metadata().file_metadata().schema() != schema(&manifest)?.as_ref() {
            return Err(shape());
        }
        Ok(RowReader { file, manifest, next_group: 0, rows: Vec::new().into_iter() })
    }

    pub(super) fn manifest(&self) -> &Manifest {
        &self.manifest
    }

    fn group(&self, index: usize) -> Result<Vec<ResultRow>> {
        let group = self.file.get_row_group(index)?;
        let group = group.as_ref();
        let columns = self.manifest.columns().len();
        let text = |bytes: ByteArray| bytes.as_utf8().map(str::to_owned);
        let flights = take::<Int64Type>(group, 0)?;
        let mut seeds = take::<Int64Type>(group, 1)?.into_iter();
        let mut contenders = take::<ByteArrayType>(group, 2)?.into_iter();
        let mut trajectories = take::<ByteArrayType>(group, 3)?.into_iter();
        // Column 4, `lost`, is for other readers: it follows from the reason.
        let mut losses = take::<ByteArrayType>(group, 5)?.into_iter();
        let mut trips = take::<ByteArrayType>(group, 6)?.into_iter();
        let numbers = (0..columns).map(|column| Ok(take::<DoubleType>(group, LABELS.len() + column)?.into_iter()));
        let mut numbers = numbers.collect::<Result<Vec<_>>>()?;
        let row = |flight: Option<i64>| {
            Ok(ResultRow {
                flight: flight.ok_or_else(shape)?.cast_unsigned(),
                seed: seeds.next().flatten().ok_or_else(shape)?.cast_unsigned(),
                contender: text(contenders.next().flatten().ok_or_else(shape)?)?,
                trajectory: text(trajectories.next().flatten().ok_or_else(shape)?)?,
                lost_reason: losses.next().flatten().map(text).transpose()?,
                trip_reason: trips.next().flatten().map(text).transpose()?,
                numbers: numbers.iter_mut().map(|column| column.next().flatten()).collect(),
            })
        };
        flights.into_iter().map(row).collect()
    }
}

impl<R: ChunkReader + 'static> Iterator for RowReader<R> {
    type Item = Result<ResultRow>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rows.len() == 0 && self.next_group < self.file.num_row_groups() {
            match self.group(self.next_group) {
                Ok(rows) => self.rows = rows.into_iter(),
                Err(error) => return Some(Err(error)),
            }
            self.next_group += 1;
        }
        self.rows.next().map(Ok)
    }
}

/// Reads one column of a group.
fn take<T: DataType>(group: &dyn RowGroupReader, index: usize) -> Result<Vec<Option<T::T>>>
where
    T::T: Default,
{
    let rows = usize::try_from(group.metadata().num_rows())?;
    let optional = group.metadata().column(index).column_descr().max_def_level() > 0;
    let mut column = get_typed_column_reader::<T>(group.get_column_reader(index)?);
    let (mut present, mut dense) = (Vec::new(), Vec::new());
    column.read_records(rows, Some(&mut present), None, &mut dense)?;
    if !optional {
        // A required column has no definition levels.
        present = vec![1; dense.len()];
    }
    if present.len() != rows {
        return Err(shape());
    }
    let mut dense = dense.into_iter();
    Ok(present.into_iter().map(|present| if present == 0 { None } else { dense.next() }).collect())
}

fn shape() -> ParquetError {
    ParquetError::General("the file's columns are not those of a campaign".into())
}

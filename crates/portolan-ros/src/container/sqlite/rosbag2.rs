//! What rosbag2 keeps in its database: tables `topics`, `messages` and, from Iron on, `message_definitions`.

use std::collections::HashMap;

use super::super::index::{Channel, Entry, FileIndex, is_transient_local, told};
use super::super::reader::FileReader;
use super::super::topic::{DefinitionFormat, Encoding, Topic};
use super::pages::{Leaf, Pages};
use super::record::{Value, columns, value};
use super::schema::{Table, tables};
use crate::{BagError, Result};

/// How messages are found in the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pages: Pages,
    topic: usize,
    time: usize,
    data: usize,
}

/// Finds the messages, by a walk over the leaves of their table.
pub(crate) fn index(reader: &mut FileReader, allow_damage: bool) -> Result<(FileIndex, Layout)> {
    let pages = Pages::read(reader)?;
    let mut index = FileIndex::default();
    if pages.count < pages.said {
        let value = format!("{} where the file has {}", pages.said, pages.count);
        let error = reader.damaged(28, "the number of pages", value);
        if !allow_damage {
            return Err(error);
        }
        index.notes.push(told(&error, "what can be reached is used"));
    }
    let mut damage = Damage { allowed: allow_damage, first: None, pages: 0, rows: 0 };
    let tables = tables(&pages, reader, |error| damage.page(error))?;
    let (topics, messages) = (tables.get("topics"), tables.get("messages"));
    let (Some(topics), Some(messages)) = (topics, messages) else {
        let name = reader.name().to_owned();
        let reason = "is an sqlite3 database without the tables `topics` and `messages`".to_owned();
        return Err(BagError::Refused { name, reason, advice: "only rosbag2's databases are read".into() });
    };
    let definitions = match tables.get("message_definitions") {
        Some(table) => read_definitions(&pages, reader, table, &mut damage)?,
        None => HashMap::new(),
    };
    index.channels = read_topics(&pages, reader, topics, &definitions, &mut damage)?;
    let column = |name: &str| {
        messages.column(name).ok_or_else(|| {
            reader.wrong(
                pages.place(messages.root),
                "the table `messages`",
                format!("without {name}"),
                "not a rosbag2",
            )
        })
    };
    let layout =
        Layout { pages, topic: column("topic_id")?, time: column("timestamp")?, data: column("data")? };
    let known: HashMap<u32, ()> = index.channels.iter().map(|c| (c.id, ())).collect();
    let mut entries = Vec::new();
    let mut lost = Damage { allowed: allow_damage, first: None, pages: 0, rows: 0 };
    pages.leaves(
        reader,
        messages.root,
        |error| damage.page(error),
        |reader, leaf, rows| {
            for row in 0..rows {
                let found = layout.row(reader, leaf, row).and_then(|(channel, log_time, ..)| {
                    if !known.contains_key(&channel) {
                        let place = pages.place(leaf.number());
                        return Err(reader.damaged(place, format!("the topic of row {row}"), channel));
                    }
                    Ok(Entry { channel, log_time, place: leaf.number(), within: row })
                });
                match found {
                    Ok(entry) => entries.push(entry),
                    Err(error) => lost.row(error)?,
                }
            }
            Ok(())
        },
    )?;
    damage.pages += lost.pages;
    damage.rows += lost.rows;
    index.entries = entries;
    if let Some(error) = damage.first.or(lost.first) {
        let what = format!("{} pages and {} single messages are left out", damage.pages, damage.rows);
        index.notes.push(told(&error, &what));
    }
    Ok((index, layout))
}

/// Damage that was allowed.
struct Damage {
    allowed: bool,
    first: Option<BagError>,
    pages: u64,
    rows: u64,
}

impl Damage {
    fn page(&mut self, error: BagError) -> Result<()> {
        self.take(error)?;
        self.pages += 1;
        Ok(())
    }

    fn row(&mut self, error: BagError) -> Result<()> {
        self.take(error)?;
        self.rows += 1;
        Ok(())
    }

    fn take(&mut self, error: BagError) -> Result<()> {
        if !self.allowed || !matches!(error, BagError::Damaged { .. }) {
            return Err(error);
        }
        self.first.get_or_insert(error);
        Ok(())
    }
}

impl Layout {
    /// Topic and log time of the row `within` of page `place`; its bytes in `data`.
    pub(crate) fn read(
        &self,
        reader: &mut FileReader,
        leaf: &mut Leaf,
        place: u64,
        within: u32,
        data: &mut Vec<u8>,
    ) -> Result<(u32, i64)> {
        self.pages.leaf(reader, place, leaf)?;
        let (channel, time, cell, columns) = self.row(reader, leaf, within)?;
        let column = columns.get(self.data).filter(|c| c.is_data()).ok_or_else(|| {
            reader.damaged(self.pages.place(leaf.number()), format!("the data of row {within}"), "not bytes")
        })?;
        self.pages.payload(reader, leaf, &cell, column.bytes.clone(), data)?;
        Ok((channel, time))
    }

    fn row(
        &self,
        reader: &mut FileReader,
        leaf: &Leaf,
        row: u32,
    ) -> Result<(u32, i64, super::pages::Cell, Vec<super::record::Column>)> {
        let cell = self.pages.cell(reader, leaf, row)?;
        let columns = columns(&self.pages, reader, leaf, &cell)?;
        let topic = value(&self.pages, reader, leaf, &cell, columns.get(self.topic))?;
        let time = value(&self.pages, reader, leaf, &cell, columns.get(self.time))?;
        let place = self.pages.place(leaf.number());
        let channel = match topic {
            Value::Integer(id) => u32::try_from(id).ok(),
            _ => None,
        };
        let Some(channel) = channel else {
            return Err(reader.damaged(place, format!("the topic of row {row}"), format!("{topic:?}")));
        };
        let Value::Integer(time) = time else {
            return Err(reader.damaged(place, format!("the timestamp of row {row}"), format!("{time:?}")));
        };
        Ok((channel, time, cell, columns))
    }
}

/// Calls `take` with the values of the named columns of each row; a column that the table lacks is null.
fn rows<const N: usize>(
    pages: &Pages,
    reader: &mut FileReader,
    table: &Table,
    names: [&str; N],
    damage: &mut Damage,
    mut take: impl FnMut(&FileReader, u64, [Value; N]) -> Result<()>,
) -> Result<()> {
    let places = names.map(|name| table.column(name));
    pages.leaves(
        reader,
        table.root,
        |error| damage.page(error),
        |reader, leaf, count| {
            for row in 0..count {
                let cell = pages.cell(reader, leaf, row)?;
                let found = columns(pages, reader, leaf, &cell)?;
                let mut values = [const { Value::Null }; N];
                for (slot, place) in values.iter_mut().zip(places) {
                    let Some(place) = place else { continue };
                    *slot = value(pages, reader, leaf, &cell, found.get(place))?;
                    if *slot == Value::Null && table.is_rowid(place) {
                        *slot = Value::Integer(cell.rowid);
                    }
                }
                take(reader, pages.place(leaf.number()), values)?;
            }
            Ok(())
        },
    )
}

/// Language and text of the definition of each type.
fn read_definitions(
    pages: &Pages,
    reader: &mut FileReader,
    table: &Table,
    damage: &mut Damage,
) -> Result<HashMap<String, (String, String)>> {
    let mut all = HashMap::new();
    let names = ["topic_type", "encoding", "encoded_message_definition"];
    rows(pages, reader, table, names, damage, |_, _, values| {
        if let [Value::Text(type_name), Value::Text(language), Value::Text(text)] = values {
            all.insert(type_name, (language, text));
        }
        Ok(())
    })?;
    Ok(all)
}

fn read_topics(
    pages: &Pages,
    reader: &mut FileReader,
    table: &Table,
    definitions: &HashMap<String, (String, String)>,
    damage: &mut Damage,
) -> Result<Vec<Channel>> {
    let mut channels = Vec::new();
    let names = ["id", "name", "type", "serialization_format", "offered_qos_profiles"];
    rows(pages, reader, table, names, damage, |reader, place, values| {
        let [Value::Integer(id), Value::Text(name), Value::Text(type_name), format, profiles] = values else {
            return Err(reader.damaged(place, "a row of the table `topics`", "without number, name or type"));
        };
        let id = u32::try_from(id).map_err(|_| reader.damaged(place, "the number of a topic", id))?;
        let topic = match format {
            // The first rosbag2 had no such column and no other format.
            Value::Null => Ok(Encoding::Cdr),
            Value::Text(f) if f == "cdr" || f.is_empty() => Ok(Encoding::Cdr),
            Value::Text(other) => {
                Err(format!("{name}: its messages are written as {other:?}, which is not read"))
            }
            other => {
                return Err(reader.damaged(
                    place,
                    "the serialization format of a topic",
                    format!("{other:?}"),
                ));
            }
        };
        let topic = topic.map(|encoding| {
            let none = (String::new(), String::new());
            let (language, definition) = definitions.get(&type_name).unwrap_or(&none);
            let definition_format = match language.as_str() {
                _ if definition.trim().is_empty() => DefinitionFormat::Missing,
                "ros2msg" => DefinitionFormat::Ros2Msg,
                "ros2idl" => DefinitionFormat::Ros2Idl,
                // rosbag2 writes "unknown" where it did not find the definition.
                _ => DefinitionFormat::Missing,
            };
            let missing = definition_format == DefinitionFormat::Missing;
            Topic {
                name,
                type_name,
                encoding,
                definition_format,
                definition: if missing { String::new() } else { definition.clone() },
                publisher: None,
                latched: matches!(profiles, Value::Text(p) if is_transient_local(&p)),
            }
        });
        channels.push(Channel { id, topic });
        Ok(())
    })?;
    Ok(channels)
}

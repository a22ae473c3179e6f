//! Schemas and channels that were met, and the topics that they are.

use std::collections::HashMap;

use mcap::records::{self, Record};

use super::super::index::{Channel, is_transient_local};
use super::super::topic::{DefinitionFormat, Encoding, Topic};
use super::record::Wrong;

/// What is known of channels so far.
#[derive(Default)]
pub(super) struct Channels {
    schemas: HashMap<u16, (String, String, String)>,
    pub(super) records: HashMap<u16, records::Channel>,
    pub(super) found: Vec<Channel>,
}

impl Channels {
    /// Takes a schema or a channel; what is wrong with it.
    pub(super) fn take(&mut self, record: Record<'_>) -> Result<(), (&'static str, String)> {
        match record {
            Record::Schema { header, data } => {
                let text = String::from_utf8_lossy(&data).into_owned();
                let schema = (header.name, header.encoding, text);
                match self.schemas.insert(header.id, schema.clone()) {
                    Some(old) if old != schema => {
                        Err(("the schema", format!("number {} again and different", header.id)))
                    }
                    _ => Ok(()),
                }
            }
            Record::Channel(channel) => {
                match self.records.get(&channel.id) {
                    Some(old) if *old == channel => return Ok(()),
                    Some(_) => {
                        return Err(("the channel", format!("number {} again and different", channel.id)));
                    }
                    None => {}
                }
                let schema = self.schemas.get(&channel.schema_id);
                if schema.is_none() && channel.schema_id != 0 {
                    let value = format!("schema {}, which is not in the file", channel.schema_id);
                    return Err(("the channel's schema", value));
                }
                let topic = topic(&channel, schema);
                self.found.push(Channel { id: channel.id.into(), topic });
                self.records.insert(channel.id, channel);
                Ok(())
            }
            _ => Ok(()),
        }
    }
}

fn topic(channel: &records::Channel, schema: Option<&(String, String, String)>) -> Result<Topic, String> {
    let (type_name, language, definition) = match schema {
        Some((name, language, text)) => (name.as_str(), language.as_str(), text.as_str()),
        None => Default::default(),
    };
    let name = &channel.topic;
    let encoding = match channel.message_encoding.as_str() {
        "cdr" => Encoding::Cdr,
        "ros1" => Encoding::Ros1,
        other => return Err(format!("{name}: its messages are encoded as {other:?}, which is not read")),
    };
    let definition_format = match (encoding, language) {
        _ if definition.trim().is_empty() => DefinitionFormat::Missing,
        (Encoding::Ros1, "ros1msg") => DefinitionFormat::Ros1Msg,
        (Encoding::Cdr, "ros2msg") => DefinitionFormat::Ros2Msg,
        (Encoding::Cdr, "ros2idl") => DefinitionFormat::Ros2Idl,
        (_, other) => {
            return Err(format!("{name}: its definition is written as {other:?}, which is not read"));
        }
    };
    let has = |key: &str| channel.metadata.get(key);
    Ok(Topic {
        name: name.clone(),
        type_name: type_name.to_owned(),
        encoding,
        definition_format,
        definition: if definition_format == DefinitionFormat::Missing { "" } else { definition }.to_owned(),
        publisher: has("callerid").cloned(),
        latched: has("latching").is_some_and(|v| v == "1")
            || has("offered_qos_profiles").is_some_and(|p| is_transient_local(p)),
    })
}

pub(super) fn known(channels: &Channels, id: u32) -> Result<(), Wrong> {
    match channels.records.contains_key(&(id as u16)) {
        true => Ok(()),
        false => Err(("the channel of a message", format!("{id}, which is not in the file before it"))),
    }
}

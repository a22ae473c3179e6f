//! Connections that were met, and the topics that they are.

use std::collections::HashMap;

use super::super::index::Channel;
use super::super::topic::{DefinitionFormat, Encoding, Topic};
use super::record::Fields;

/// Connections that were met.
#[derive(Default)]
pub(super) struct Connections {
    pub(super) known: HashMap<u32, (Vec<u8>, Vec<u8>)>,
    pub(super) found: Vec<Channel>,
}

impl Connections {
    pub(super) fn take(&mut self, header: Fields<'_>, data: &[u8]) -> Result<(), String> {
        let fields = Fields(data);
        let (Some(id), Some(name)) = (header.u32(b"conn"), header.text(b"topic")) else {
            return Err("without number or topic".into());
        };
        let Some(type_name) = fields.text(b"type").filter(|_| fields.valid()) else {
            return Err("without a type".into());
        };
        let record = (header.get(b"topic").unwrap_or_default().to_vec(), data.to_vec());
        match self.known.get(&id) {
            Some(old) if *old == record => return Ok(()),
            Some(_) => return Err(format!("number {id} again and different")),
            None => {}
        }
        let definition = fields.text(b"message_definition").unwrap_or_default();
        let missing = definition.is_empty() && fields.get(b"message_definition").is_none();
        let format = if missing { DefinitionFormat::Missing } else { DefinitionFormat::Ros1Msg };
        let topic = Topic {
            name,
            type_name,
            encoding: Encoding::Ros1,
            definition_format: format,
            definition,
            publisher: fields.text(b"callerid").filter(|p| !p.is_empty()),
            latched: fields.get(b"latching") == Some(b"1"),
        };
        self.found.push(Channel { id, topic: Ok(topic) });
        self.known.insert(id, record);
        Ok(())
    }
}

//! Definitions of messages, bytes to values, and the messages that maps are made of.

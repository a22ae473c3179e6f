#![no_main]
portolan_fuzz::target!("message", portolan_fuzz::readers::message);

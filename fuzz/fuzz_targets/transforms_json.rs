#![no_main]
portolan_fuzz::target!("transforms_json", portolan_fuzz::readers::transforms_json);

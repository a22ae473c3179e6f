#![no_main]
portolan_fuzz::target!("mesh", portolan_fuzz::readers::mesh);

#![no_main]
portolan_fuzz::target!("container", portolan_fuzz::readers::container);

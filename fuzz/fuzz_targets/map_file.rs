#![no_main]
portolan_fuzz::target!("map_file", portolan_fuzz::readers::map_file);

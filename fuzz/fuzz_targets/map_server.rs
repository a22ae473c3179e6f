#![no_main]
portolan_fuzz::target!("map_server", portolan_fuzz::readers::map_server);

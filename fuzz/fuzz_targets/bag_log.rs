#![no_main]
portolan_fuzz::target!("bag_log", portolan_fuzz::readers::bag_log);

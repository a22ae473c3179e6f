#![no_main]
portolan_fuzz::target!("pcd", portolan_fuzz::readers::pcd);

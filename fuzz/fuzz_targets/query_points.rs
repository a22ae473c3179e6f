#![no_main]
portolan_fuzz::target!("query_points", portolan_fuzz::readers::query_points);

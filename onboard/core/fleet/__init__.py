"""Many flights of one accelerometer, and many vehicles: numbers over time and over vehicles."""

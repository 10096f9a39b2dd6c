// SPDX-License-Identifier: GPL-2.0-or-later
/*
 * SPI and UART (protocol sections 3.16 and 3.17), each with a plug which leads
 * its output back to its input.
 */
#include "sim/request.h"

#define OK 1

static void spi_setup(struct sim_device *dev, const uint8_t *rq, uint8_t *rp)
{
	if (rq[P2] < 2 || rq[P2] > 254 || rq[P2] % 2) {
		rp[P2] = 0;
		return;
	}
	dev->bus.spi_prescaler = rq[P2];
	dev->bus.spi_mode = rq[P3];
}

SIM_HANDLER(sim_do_spi)
{
	struct sim_bus *bus = &dev->bus;
	uint8_t len = rq[P2] > sizeof(bus->spi_data) ? sizeof(bus->spi_data) : rq[P2];

	rp[P1] = rq[P1];
	rp[P2] = OK;
	switch (rq[P1]) {
	case 0x01:
		spi_setup(dev, rq, rp);
		break;
	case 0x10:
		memset(bus->spi_data, 0, sizeof(bus->spi_data));
		memcpy(bus->spi_data, rq + 8, len);
		break;
	case 0x20:
		memcpy(rp + 8, bus->spi_data, len);
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	return SIM_ANSWER;
}

static void uart_send(struct sim_uart *uart, const uint8_t *rq, uint8_t *rp)
{
	uint8_t count = 0;

	while (count < rq[P3] && count < 55 && uart->used < SIM_UART_BYTES) {
		uart->bytes[(uart->head + uart->used++) % SIM_UART_BYTES] = rq[8 + count];
		count++;
	}
	rp[P2] = count;
}

static void uart_read(struct sim_uart *uart, uint8_t *rp)
{
	uint8_t count = 0;

	while (count < 55 && uart->used) {
		rp[8 + count++] = uart->bytes[uart->head];
		uart->head = (uint16_t)((uart->head + 1) % SIM_UART_BYTES);
		uart->used--;
	}
	rp[P2] = count;
}

SIM_HANDLER(sim_do_uart)
{
	struct sim_uart *uart;

	rp[P1] = rq[P1];
	if (rq[P2] < 1 || rq[P2] > SIM_UARTS)
		return SIM_ANSWER;
	uart = &dev->bus.uart[rq[P2] - 1];
	switch (rq[P1]) {
	case 0x10:
		uart->format = rq[P3];
		uart->baud = wire_get_u32(rq + 8);
		break;
	case 0x20:
		uart_send(uart, rq, rp);
		break;
	case 0x30:
		uart_read(uart, rp);
		break;
	default:
		return SIM_ANSWER_UNKNOWN;
	}
	return SIM_ANSWER;
}

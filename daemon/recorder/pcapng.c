/* SPDX-License-Identifier: GPL-2.0-or-later */
/*
 * Writing pcapng.
 *
 * Every block says its length at both ends and is filled up to four bytes, and so
 * is every option. Numbers are in this machine's byte order, which the first block
 * tells. Events are journal entries and not comments: an event belongs to a moment,
 * not to the packet that happened to be next, and Wireshark shows it as a line of
 * its own between the packets. Programs that do not know such blocks pass them over.
 */
#include <string.h>
#include "daemon/recorder/pcapng.h"
#include "daemon/recorder/pcapng_block.h"

static uint32_t padded(size_t length)
{
	return (uint32_t)((length + 3) & ~(size_t)3);
}

static void put16(FILE *to, uint16_t value)
{
	fwrite(&value, sizeof(value), 1, to);
}

static void put32(FILE *to, uint32_t value)
{
	fwrite(&value, sizeof(value), 1, to);
}

static void put_bytes(FILE *to, const void *bytes, size_t length)
{
	static const char zeros[4];

	fwrite(bytes, 1, length, to);
	fwrite(zeros, 1, padded(length) - length, to);
}

/* Bytes that an option takes; an empty text is no option. */
static uint32_t option_size(size_t length)
{
	return length ? 4 + padded(length) : 0;
}

static void put_option(FILE *to, uint16_t code, const void *value, size_t length)
{
	if (!length)
		return;
	put16(to, code);
	put16(to, (uint16_t)length);
	put_bytes(to, value, length);
}

static void put_text(FILE *to, uint16_t code, const char *text)
{
	put_option(to, code, text, strlen(text));
}

void pcapng_begin(FILE *to, const char *application, const char *comment)
{
	const uint32_t length = 28 + option_size(strlen(comment)) +
				option_size(strlen(application)) + 4;

	put32(to, PCAPNG_SECTION);
	put32(to, length);
	put32(to, PCAPNG_BYTE_ORDER);
	put16(to, 1);
	put16(to, 0);
	put32(to, UINT32_MAX); /* the section's length is not known yet */
	put32(to, UINT32_MAX);
	put_text(to, PCAPNG_COMMENT, comment);
	put_text(to, PCAPNG_APPLICATION, application);
	put32(to, 0);
	put32(to, length);
}

void pcapng_interface(FILE *to, const char *name, const char *description)
{
	const uint8_t nanoseconds = 9;
	const uint32_t length = 20 + option_size(strlen(name)) + option_size(strlen(description)) +
				option_size(1) + 4;

	put32(to, PCAPNG_INTERFACE);
	put32(to, length);
	put16(to, PCAPNG_ETHERNET);
	put16(to, 0);
	put32(to, PCAPNG_FRAME);
	put_text(to, PCAPNG_NAME, name);
	put_text(to, PCAPNG_DESCRIPTION, description);
	put_option(to, PCAPNG_RESOLUTION, &nanoseconds, 1);
	put32(to, 0);
	put32(to, length);
}

void pcapng_packet(FILE *to, const struct pcapng_packet *packet)
{
	const uint32_t direction = packet->inbound ? 1 : packet->outbound ? 2 : 0;
	const uint32_t length = 32 + padded(packet->kept) + option_size(strlen(packet->comment)) +
				option_size(sizeof(direction)) + 4;

	put32(to, PCAPNG_PACKET);
	put32(to, length);
	put32(to, packet->interface);
	put32(to, (uint32_t)(packet->t_ns >> 32));
	put32(to, (uint32_t)packet->t_ns);
	put32(to, packet->kept);
	put32(to, packet->length);
	put_bytes(to, packet->data, packet->kept);
	put_text(to, PCAPNG_COMMENT, packet->comment);
	put_option(to, PCAPNG_DIRECTION, &direction, sizeof(direction));
	put32(to, 0);
	put32(to, length);
}

void pcapng_entry(FILE *to, const struct pcapng_entry *entry)
{
	char text[2 * PCAPNG_TEXT];
	int length = snprintf(text, sizeof(text),
			      "__REALTIME_TIMESTAMP=%llu\nPRIORITY=%d\n"
			      "SYSLOG_IDENTIFIER=pokeysd\nPOKEYS_TIME_NS=%llu\n"
			      "POKEYS_DEVICE=%.64s\nMESSAGE=%.*s\n",
			      (unsigned long long)entry->t_ns / 1000, entry->level,
			      (unsigned long long)entry->t_ns, entry->device, PCAPNG_TEXT - 1,
			      entry->text);

	put32(to, PCAPNG_JOURNAL);
	put32(to, 12 + padded((size_t)length));
	put_bytes(to, text, (size_t)length);
	put32(to, 12 + padded((size_t)length));
}

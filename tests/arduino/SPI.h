/* What the sketch takes of the SPI library of an Arduino core, declared only. */
#ifndef SPI_STUB_H
#define SPI_STUB_H

#include <Arduino.h>

#define LSBFIRST 0
#define MSBFIRST 1
#define SPI_MODE0 0
#define SPI_MODE1 1
#define SPI_MODE2 2
#define SPI_MODE3 3

struct SPISettings {
    SPISettings(uint32_t clock, uint8_t order, uint8_t mode) : baud(clock), bits(order), edges(mode) {}
    uint32_t baud;
    uint8_t bits, edges;
};

class SPIBus {
  public:
    void setSCK(uint8_t pin);
    void setTX(uint8_t pin);
    void setRX(uint8_t pin);
    void begin();
    void beginTransaction(SPISettings settings);
    uint8_t transfer(uint8_t byte);
    void endTransaction();
};
extern SPIBus SPI;

#endif
